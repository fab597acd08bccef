// Pixels that a depth image covers in part: what is behind is what the pixels around show of it.
#include "common/distance.glsl"
uniform sampler2D surface_texture;
uniform sampler2D lit_texture;      // as it was
layout(location = 0) out vec4 lit;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float open = texelFetch(surface_texture, pixel, 0).a;
    vec4 behind_it = vec4(0.0);
    float total = 0.0;
    // A loop that most pixels never enter: software rasterisers run all of what is not in one.
    for (int k = open > 0.0 ? 0 : 9; k < 9; ++k) {
        float farthest = behind(distance_at(pixel), OUTLINE);
        ivec2 aside = ivec2(k % 3, k / 3) - 1;
        ivec2 other = clamp(pixel + aside, ivec2(0), textureSize(lit_texture, 0) - 1);
        if (distance_at(other) <= farthest) continue;
        float weight = (1.0 - texelFetch(surface_texture, other, 0).a) / float(dot(aside, aside));
        behind_it += weight * texelFetch(lit_texture, other, 0);
        total += weight;
    }
    if (total == 0.0) discard;
    lit = mix(texelFetch(lit_texture, pixel, 0), behind_it / total, open);
}
