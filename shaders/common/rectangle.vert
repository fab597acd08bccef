// Covers a rectangle of the picture, in clip space, at one depth; each further instance lies in front of the one before.
#from depthwalk.render.draw.material_depth import FULL_COVERAGE     // the difference of their depths
#include "common/view.glsl"
uniform float depth;        // of the first instance, 0 to 1
uniform vec4 corners;       // the lower left and the upper right one, −1 to 1

out vec2 uv;                // over the picture, 0 to 1
out vec3 ray;               // world, from the viewer to one metre along the view axis

void main() {
    vec2 at = mix(corners.xy, corners.zw, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    uv = at * 0.5 + 0.5;
    ray = ray_from_screen * vec3(at, 1.0);
    gl_Position = vec4(at, 2.0 * (depth - FULL_COVERAGE * float(gl_InstanceID)) - 1.0, 1.0);
}
