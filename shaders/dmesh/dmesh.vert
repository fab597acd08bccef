// Warps depth samples in 3-D, straight to clip space, for a viewer inside the cylinder, who has no plane in front of the object
// (and as a rival: Pajarola et al. 2004, "DMesh").
#include "common/per_sample.glsl"
#include "common/placed_samples.glsl"
uniform uint first;     // number of the first object

flat out uint object;
flat out uint image;
PER_SAMPLE out float forward;  // metres along the view axis

void main() {
    vec3 from_viewer = placed_sample();
    image = sample_image(in_sample);
    object = first + uint(gl_InstanceID);
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
    forward = gl_Position.w;
    float farther = 1.0 + in_scale * sample_setback(in_sample) / max(length(from_viewer), 1e-6);
    gl_Position.z = (clip_from_eye * vec4(from_viewer * farther, 1.0)).z / farther;     // w is farther times as large there
}
