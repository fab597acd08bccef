// Smooths edges of the lit picture, in texture space: fast approximate anti-aliasing (Lottes 2009, the variant with five
// taps of brightness). Where brightness jumps, the picture is blurred along the edge, which is perpendicular to the gradient.
// Twin: reference/fxaa.py.
#include "common/brightness.glsl"
uniform sampler2D lit_texture;      // as it was, linear filter
uniform float contrast;             // least contrast of an edge, as a part of the brightest pixel around

in vec2 uv;
layout(location = 0) out vec4 lit;

const float SHORTEST = 1.0 / 128.0;
const float SHORTENED = 1.0 / 8.0;  // the brighter the surroundings, the shorter the blur
const float LONGEST = 8.0;          // pixels

vec4 at(vec2 place) { return texture(lit_texture, place); }

void main() {
    vec2 pixel = 1.0 / vec2(textureSize(lit_texture, 0));
    vec4 here = at(uv);
    float middle = brightness(here);
    float nw = brightness(at(uv + vec2(-0.5, 0.5) * pixel)), ne = brightness(at(uv + vec2(0.5, 0.5) * pixel));
    float sw = brightness(at(uv + vec2(-0.5, -0.5) * pixel)), se = brightness(at(uv + vec2(0.5, -0.5) * pixel));
    float darkest = min(middle, min(min(nw, ne), min(sw, se))), brightest = max(middle, max(max(nw, ne), max(sw, se)));
    lit = here;
    if (brightest - darkest < max(contrast * brightest, SHORTEST)) return;
    vec2 along = vec2(sw + se - nw - ne, ne + se - nw - sw);    // across the gradient
    float damping = max((nw + ne + sw + se) * 0.25 * SHORTENED, SHORTEST);
    along = clamp(along / (min(abs(along.x), abs(along.y)) + damping), -LONGEST, LONGEST) * pixel;
    vec4 narrow = 0.5 * (at(uv - along / 6.0) + at(uv + along / 6.0));
    vec4 wide = 0.5 * narrow + 0.25 * (at(uv - along / 2.0) + at(uv + along / 2.0));
    float reached = brightness(wide);
    lit = reached < darkest || reached > brightest ? narrow : wide;    // beyond the edge's brightness is something else
}
