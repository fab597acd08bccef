// Draws the sky or the plain background, in world directions, as linear radiance.
// TRANSPARENT: the picture is empty where nothing is; DISC: with the disc of the sun.
#include "common/sky.glsl"
#ifdef DISC
#include "common/view.glsl"
uniform vec3 to_sun;
uniform vec3 disc;              // linear radiance
uniform float disc_radius;      // radians
#endif

in vec3 ray;
layout(location = 0) out vec4 lit;

void main() {
#ifdef TRANSPARENT
    lit = vec4(0.0);
#else
    vec3 direction = normalize(ray);
    lit = vec4(sky_at(direction), 1.0);
#ifdef DISC
    lit.rgb += disc * clamp((disc_radius - distance(direction, to_sun)) / pixel_angle + 0.5, 0.0, 1.0);
#endif
#endif
}
