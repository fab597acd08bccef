// Blends pixels that a depth image covers in part with what is behind it, in linear light: that is what the pixels around
// show of it.
#include "common/distance.glsl"
#include "common/visible.glsl"
uniform usampler2D visibility_texture;
uniform sampler2D lit_texture;      // as it was
layout(location = 0) out vec4 lit;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec2 visible = texelFetch(visibility_texture, pixel, 0).xy;
    float uncovered = uncovered_of(visible), farthest = depth_of(behind(distance_of(visible), OUTLINE)), total = 0.0;
    vec4 behind_it = vec4(0.0);
    // A loop that most pixels never enter: software rasterisers run all of what is not in one.
    for (int k = uncovered > 0.0 ? 0 : 9; k < 9; ++k) {
        ivec2 other = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), textureSize(lit_texture, 0) - 1);
        float weight = texelFetch(depth_texture, other, 0).r > farthest ? float(1 + k % 2) : 0.0;     // beside counts twice
        behind_it += weight * texelFetch(lit_texture, other, 0);
        total += weight;
    }
    if (total == 0.0) discard;
    lit = mix(texelFetch(lit_texture, pixel, 0), behind_it / total, uncovered);
}
