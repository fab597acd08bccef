// Computes fog between the viewer and lit surfaces, in world space, and blends it by its transmittance e^(−density · metres)
// (Beer and Lambert). Twin: reference/fog.py.
// FOG_COLOUR: it has its own colour; else that of the sky at the horizon. TRANSPARENT: no fog where nothing was drawn.
#include "common/pixel.glsl"
#ifdef FOG_COLOUR
uniform vec3 fog_colour;    // linear
#else
#include "common/sky.glsl"
#endif
uniform float fog_density;  // 1/m, up to `fog_height`
uniform float fog_height;   // metres, world
uniform float fog_falloff;  // metres over which it thins to 1/e above that

// The density is 1 up to `fog_height` and thinner above. Its integral over the height, 0 at `fog_height`:
float fog_below(float y) { return y < fog_height ? y - fog_height : fog_falloff * (1.0 - exp((fog_height - y) / fog_falloff)); }
// and the density itself, as a part of the one at `fog_height`:
float fog_at(float y) { return exp(min(fog_height - y, 0.0) / fog_falloff); }

// Metres of fog of the density at `fog_height` that equal the fog along `way`, or to the sky in that direction.
float fog_along(vec3 way) {
    float rise = way.y, from = fog_below(view_position.y);
    // If the way is nearly level, the difference of the integrals would be lost in rounding.
    if (abs(rise) < 1e-2 * fog_falloff) return length(way) * fog_at(view_position.y + 0.5 * rise);
    return length(way) * (fog_below(view_position.y + rise) - from) / rise;
}
float fog_to_sky(vec3 direction) {
    float above = fog_falloff * fog_at(view_position.y) + max(fog_height - view_position.y, 0.0);
    return direction.y > 0.0 ? above / direction.y : 1e30;
}

// The colour of fog in a world direction, of unit length.
vec3 fog_towards(vec3 direction) {
#ifdef FOG_COLOUR
    return fog_colour;
#elif defined SKY_IMAGE
    return horizon_at(direction);
#else
    // Not normalised: straight up and down all azimuths meet, where the glow about the sun must have faded.
    return sky_at(vec3(direction.x, 0.0, direction.z));
#endif
}

// The part of the light that passes through the given metres of fog.
float through_fog(float metres) { return exp(-fog_density * metres); }

void draw_fog(inout Pixel pixel) {
    vec3 direction = normalize(pixel.ray);
#ifdef SKY
#ifdef TRANSPARENT
    return;
#endif
    float metres = fog_to_sky(direction);
#else
    float metres = fog_along(pixel.ray * distance_of(pixel.depth));
#endif
    pixel.lit.rgb = mix(fog_towards(direction), pixel.lit.rgb, through_fog(metres));
}
