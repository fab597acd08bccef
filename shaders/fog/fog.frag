// Computes fog between the viewer and what is lit, in world space, and blends it by how much light comes through (Beer and
// Lambert). Twin: reference/fog.py.
// COLOUR: of its own; else that of the sky at the horizon.
#include "common/distance.glsl"
#ifdef COLOUR
uniform vec3 colour;        // linear
#else
#include "common/sky.glsl"
#endif
uniform float density;      // 1/m, up to `height`
uniform float height;       // metres, world
uniform float falloff;      // metres over which it thins to 1/e above that
uniform int transparent;    // 1: no fog where nothing was drawn

in vec2 uv;
in vec3 ray;
layout(location = 0) out vec4 lit;

// The density is 1 up to `height` and thinner above. Its integral over the height, 0 at `height`:
float fog_below(float y) { return y < height ? y - height : falloff * (1.0 - exp((height - y) / falloff)); }
// and itself, as part of the one at `height`:
float fog_at(float y) { return exp(min(height - y, 0.0) / falloff); }

// Metres of fog as it is at `height` along `way`, or to the sky in that direction.
float fog_along(vec3 way) {
    float rise = way.y, from = fog_below(view_position.y);
    // The way is so level that the difference would be lost in rounding.
    if (abs(rise) < 1e-2 * falloff) return length(way) * fog_at(view_position.y + 0.5 * rise);
    return length(way) * (fog_below(view_position.y + rise) - from) / rise;
}
float fog_to_sky(vec3 direction) {
    float above = falloff * fog_at(view_position.y) + max(height - view_position.y, 0.0);
    return direction.y > 0.0 ? above / direction.y : 1e30;
}

void main() {
    float depth = texture(depth_texture, uv).r;
    bool sky = depth == 1.0;
    if (sky && transparent != 0) discard;
    vec3 direction = normalize(ray);
    float metres = sky ? fog_to_sky(direction) : fog_along(ray * distance_of(depth));
#ifndef COLOUR
    vec3 colour = sky_at(vec3(direction.x, 0.0, direction.z) / max(length(direction.xz), 1e-3));
#endif
    lit = vec4(colour, 1.0 - exp(-density * metres));
}
