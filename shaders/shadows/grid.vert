// Warps depth samples in 3-D, straight to the clip space of a shadow map, see docs/algorithms.md; positions are relative to the
// map's centre instead of the viewer.
#include "common/placed_samples.glsl"

void main() {
    vec3 point = placed_sample();
    vec3 from_light = point * eye.w - eye.xyz;
    float away = max(length(from_light), 1e-6), further = in_scale * sample_setback(in_sample) / away;
    gl_Position = clip_from_eye * vec4(point, 1.0);
    // There w is larger by this factor. It may be 0, beside a lamp, so that it cannot be divided by.
    gl_Position.z = (clip_from_eye * vec4(point + further * from_light, 1.0)).z / (1.0 + further * eye.w);
}
