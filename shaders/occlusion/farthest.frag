// The farthest depth in each cell of `side` × `side` pixels; twin: reference/occlusion.py.
uniform sampler2D depth_texture;
uniform int side;       // even

layout(location = 0) out float farthest;

void main() {
    ivec2 size = textureSize(depth_texture, 0), first = ivec2(gl_FragCoord.xy) * side;
    vec4 most = vec4(0.0);
    for (int y = first.y; y < first.y + side; y += 2) {
        for (int x = first.x; x < first.x + side; x += 2) {
#ifdef TEXTURE_GATHER
            vec4 four = textureGather(depth_texture, vec2(x + 1, y + 1) / vec2(size));
#else
            ivec2 at = ivec2(x, y), last = size - 1;
            vec4 four = vec4(texelFetch(depth_texture, min(at, last), 0).r,
                             texelFetch(depth_texture, min(at + ivec2(1, 0), last), 0).r,
                             texelFetch(depth_texture, min(at + ivec2(0, 1), last), 0).r,
                             texelFetch(depth_texture, min(at + 1, last), 0).r);
#endif
            most = max(most, four);
        }
    }
    farthest = max(max(most.x, most.y), max(most.z, most.w));
}
