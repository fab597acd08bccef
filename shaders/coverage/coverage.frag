// Blends pixels that a depth image covers in part with what is behind it, in linear light: the mean of the farther pixels
// around.
#include "common/blending.glsl"
#include "common/distance.glsl"
#include "common/visibility.glsl"
uniform usampler2D visibility_texture;
layout(location = 0) out vec4 blended;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec2 visibility = texelFetch(visibility_texture, pixel, 0).xy;
    float uncovered = uncovered_of(visibility), farthest = depth_of(behind(distance_of(visibility), SURFACE_GAP)), total = 0.0;
    vec4 behind_it = vec4(0.0);
    // A loop that most pixels never enter: software rasterisers skip loops, but execute both sides of a branch.
    for (int k = uncovered > 0.0 ? 0 : 9; k < 9; ++k) {
        ivec2 other = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), textureSize(before_texture, 0) - 1);
        // Neighbours that share an edge count twice.
        float weight = texelFetch(depth_texture, other, 0).r > farthest ? float(1 + k % 2) : 0.0;
        behind_it += weight * pixel_before(other);
        total += weight;
    }
    if (total == 0.0) discard;
    blended = written(mix(pixel_before(pixel), behind_it / total, uncovered));
}
