// Finds the farthest depth in each cell of SIDE × SIDE pixels (Greene, Kass and Miller 1993). Twin: reference/occlusion.py.
// SIDE: an even number.
// MULTISAMPLED: of all `samples` of each pixel.

layout(location = 0) out float farthest;

#ifdef MULTISAMPLED
uniform sampler2DMS depth_texture;
uniform int samples;

float farthest_of_four(ivec2 at) {
    ivec2 last = textureSize(depth_texture) - 1;
    float deepest = 0.0;
    for (int k = 0; k < 4 * samples; ++k)
        deepest = max(deepest, texelFetch(depth_texture, min(at + ivec2(k & 1, k >> 1 & 1), last), k >> 2).r);
    return deepest;
}
#else
uniform sampler2D depth_texture;

float farthest_of_four(ivec2 at) {
#ifdef TEXTURE_GATHER
    vec4 four = textureGather(depth_texture, vec2(at + 1) / vec2(textureSize(depth_texture, 0)));
#else
    ivec2 last = textureSize(depth_texture, 0) - 1;
    vec4 four = vec4(texelFetch(depth_texture, min(at, last), 0).r,
                     texelFetch(depth_texture, min(at + ivec2(1, 0), last), 0).r,
                     texelFetch(depth_texture, min(at + ivec2(0, 1), last), 0).r,
                     texelFetch(depth_texture, min(at + 1, last), 0).r);
#endif
    return max(max(four.x, four.y), max(four.z, four.w));
}
#endif

void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * SIDE;
    farthest = 0.0;
    for (int y = 0; y < SIDE; y += 2)
        for (int x = 0; x < SIDE; x += 2) farthest = max(farthest, farthest_of_four(first + ivec2(x, y)));
}
