// Finds edges between a pixel and its neighbours on the left (r) and below (g), where brightness jumps (SMAA, §4.1, with local
// contrast adaptation: no edge where a much stronger one nearby hides it).
#include "common/brightness.glsl"
uniform sampler2D lit_texture;
uniform float contrast;             // least difference of perceived brightness that is an edge

layout(location = 0) out vec2 edges;

const float HIDDEN = 0.5;           // part of the strongest jump around

float brightness_at(ivec2 pixel) {
    return brightness(texelFetch(lit_texture, clamp(pixel, ivec2(0), textureSize(lit_texture, 0) - 1), 0));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float here = brightness_at(pixel);
    vec2 low = vec2(brightness_at(pixel - ivec2(1, 0)), brightness_at(pixel - ivec2(0, 1)));
    vec2 jump = abs(here - low);
    edges = step(contrast, jump);
    if (edges == vec2(0.0)) discard;
    vec2 high = abs(here - vec2(brightness_at(pixel + ivec2(1, 0)), brightness_at(pixel + ivec2(0, 1))));
    vec2 before = abs(low - vec2(brightness_at(pixel - ivec2(2, 0)), brightness_at(pixel - ivec2(0, 2))));
    vec2 around = max(max(jump, high), before);
    edges *= step(HIDDEN * max(around.x, around.y), jump);
}
