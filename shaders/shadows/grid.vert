// Depth samples straight into a shadow map: a 3-D warp, see docs/conventions.md.
#include "common/rotation.glsl"
#include "common/samples.glsl"
#include "common/displace.glsl"
uniform mat4 clip_from_centre;
uniform vec4 light;     // where it is, from the map's centre, homogeneous

in uvec4 in_sample;     // position within the box, number of the image
in vec3 in_origin;      // of the object, world, relative to the map's centre
in vec4 in_rotation;
in float in_scale;

void main() {
    vec3 point = sample_position(in_sample);
#ifdef MESO
    float away = light.w == 0.0 ? 1.0 : length(in_origin + in_scale * rotate(in_rotation, point));
    point = displaced(point, int(sample_image(in_sample)), sample_ease(in_sample), away / in_scale);
#endif
    point = in_origin + in_scale * rotate(in_rotation, point);
    vec3 from_light = normalize(point * light.w - light.xyz);
    gl_Position = clip_from_centre * vec4(point, 1.0);
    vec4 behind = clip_from_centre * vec4(point + in_scale * sample_setback(in_sample) * from_light, 1.0);
    gl_Position.z = behind.z / behind.w * gl_Position.w;
}
