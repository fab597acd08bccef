// 3-D warp: depth samples straight to the screen, for a viewer inside the cylinder, where no plane lies between
// (and as a rival: Pajarola et al. 2004, "DMesh").
#include "common/per_sample.glsl"
#include "common/rotation.glsl"
#include "common/samples.glsl"
#include "common/displace.glsl"
uniform mat4 clip_from_eye;
uniform uint first;      // number of the first object

in uvec4 in_sample;      // position within the box, number of the image
in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

flat out uint object;
flat out uint image;
PER_SAMPLE out float forward;  // metres along the view axis

void main() {
    vec3 point = sample_position(in_sample);
#ifdef MESO
    float away = length(in_origin + in_scale * rotate(in_rotation, point)) / in_scale;
    point = displaced(point, int(sample_image(in_sample)), sample_ease(in_sample), away);
#endif
    vec3 from_viewer = in_origin + in_scale * rotate(in_rotation, point);
    image = sample_image(in_sample);
    object = first + uint(gl_InstanceID);
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
    forward = gl_Position.w;
    float farther = 1.0 + in_scale * sample_setback(in_sample) / length(from_viewer);
    vec4 behind = clip_from_eye * vec4(from_viewer * farther, 1.0);
    gl_Position.z = behind.z / behind.w * gl_Position.w;
}
