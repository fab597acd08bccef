// Writes the distances of a finished picture's surfaces along the view axis, metres; BEYOND where nothing was drawn. They are
// negative where a nearer surface begins beside a pixel. Twin: reference/finished_picture.py.
#from depthwalk.render.reprojection.reprojection import BEYOND, HIDDEN
uniform sampler2D depth_texture;
uniform vec2 planes;            // near and far plane, metres

layout(location = 0) out float ahead;

const ivec2 BESIDE[4] = ivec2[4](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1));

float depth_at(ivec2 texel) { return texelFetch(depth_texture, texel, 0).r; }
float inverse_of(float depth) { return depth < 1.0 ? mix(1.0 / planes.x, 1.0 / planes.y, depth) : 1.0 / BEYOND; }

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy), last = textureSize(depth_texture, 0) - 1;
    float inverse = inverse_of(depth_at(texel)), least = 1.0;
    for (int k = 0; k < 4; ++k) least = min(least, depth_at(clamp(texel + BESIDE[k], ivec2(0), last)));
    ahead = (inverse < HIDDEN * inverse_of(least) ? -1.0 : 1.0) / inverse;
}
