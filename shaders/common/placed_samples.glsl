// Places depth samples in the world, displaced by meso-structure, relative to the viewer or to a shadow map's centre: the first
// step of all 3-D warps.
#include "common/rotation.glsl"
#include "common/displace.glsl"

in uvec4 in_sample;     // position within the box, number of the image
in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

// point: object frame.
vec3 placed(vec3 point) { return in_origin + in_scale * rotate(in_rotation, point); }

vec3 placed_sample() {
    vec3 point = sample_position(in_sample);
    float away = eye.w == 0.0 ? 1.0 : length(placed(point));
    return placed(displaced(in_sample, point, away / in_scale));
}
