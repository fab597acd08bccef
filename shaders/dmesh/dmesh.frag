// Writes the owner of a pixel and its distance along the view axis into the visibility buffer.
//
// BACKS: backs of surfaces are drawn too, a little farther away. A leaf is so thin that its back coincides with its front.
#include "common/per_sample.glsl"
#include "common/visibility.glsl"
#from depthwalk.render.passes.dmesh import BEHIND
uniform float depth_scale;      // near · far / (far − near), metres

flat in uint object;
flat in uint image;
PER_SAMPLE in float forward;

layout(location = 0) out uvec2 visibility;

void main() {
    visibility = visibility_from(object, image, 1.0 / forward);
#ifdef BACKS
    float farther = depth_scale * (1.0 / forward - 1.0 / (forward + BEHIND));
    gl_FragDepth = gl_FragCoord.z + (gl_FrontFacing ? 0.0 : farther);
#endif
}
