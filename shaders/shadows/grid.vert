// Depth samples straight into a shadow map: a 3-D warp for an orthographic viewer, see docs/conventions.md.
#include "common/rotation.glsl"
#include "common/samples.glsl"
#include "common/displace.glsl"
uniform mat4 clip_from_centre;
uniform vec3 from_sun;      // clip space, per metre

in uvec4 in_sample;     // position within the box, number of the image
in vec3 in_origin;      // of the object, world, relative to the map's centre
in vec4 in_rotation;
in float in_scale;

void main() {
    vec3 point = sample_position(in_sample);
#ifdef MESO
    point = displaced(point, int(sample_image(in_sample)), sample_ease(in_sample), 1.0 / in_scale);
#endif
    gl_Position = clip_from_centre * vec4(in_origin + in_scale * rotate(in_rotation, point), 1.0);
    gl_Position.xyz += in_scale * sample_setback(in_sample) * from_sun;
}
