// Warps depth samples in 3-D, straight to the clip space of a shadow map, see docs/algorithms.md; positions are relative to the
// map's centre instead of the viewer.
#include "common/placed_samples.glsl"

void main() {
    vec3 point = placed_sample();
    vec3 from_light = normalize(point * eye.w - eye.xyz);
    gl_Position = clip_from_eye * vec4(point, 1.0);
    vec4 behind = clip_from_eye * vec4(point + in_scale * sample_setback(in_sample) * from_light, 1.0);
    gl_Position.z = behind.z / behind.w * gl_Position.w;
}
