// Places a level square around the world's origin, from world to clip space.
#include "common/view.glsl"
uniform float height;
uniform float half_size;

out vec3 from_viewer;
out vec2 at;                // world x, z

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    at = corner * half_size;
    from_viewer = vec3(at.x, height, at.y) - view_position;
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
}
