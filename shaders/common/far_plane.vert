// Covers the picture with one triangle at the far plane, in clip space. There a depth test for GREATER selects the pixels with
// a surface, and one for EQUAL all others.
#include "common/view.glsl"

out vec2 uv;                // over the picture, 0 to 1
out vec3 ray;               // world, from the viewer to one metre along the view axis

void main() {
    vec2 at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
    uv = at * 0.5 + 0.5;
    ray = ray_from_screen * vec3(at, 1.0);
    gl_Position = vec4(at, 1.0, 1.0);
}
