// Computes the sky or the plain background behind a pixel, in world directions, as linear radiance.
// TRANSPARENT: the picture is empty where nothing is; DISC: with the disc of the sun.
#include "common/sky.glsl"
#ifdef DISC
#include "common/view.glsl"
uniform vec3 disc;              // linear radiance
uniform float disc_radius;      // radians
#endif

// to_sun: world, of unit length, as `direction`.
vec4 background_at(vec3 direction, vec3 to_sun) {
#ifdef TRANSPARENT
    return vec4(0.0);
#else
    vec3 colour = sky_at(direction);
#ifdef DISC
    colour += disc * clamp((disc_radius - distance(direction, to_sun)) / pixel_angle + 0.5, 0.0, 1.0);
#endif
    return vec4(colour, 1.0);
#endif
}
