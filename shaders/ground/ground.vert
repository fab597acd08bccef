// Places a level square around the world's origin, from world to clip space, as nine rectangles. The one about the viewer is
// small, since clipped corners and interpolated positions are the more exact the smaller a rectangle is.
#include "common/view.glsl"
const float NEAR_BY = 100.0;    // metres, half the side of the rectangle about the viewer
uniform float height;
uniform float half_size;

out vec3 from_viewer;
out vec2 at;                // world x, z

void main() {
    ivec2 corner = ivec2(gl_InstanceID % 3 + (gl_VertexID & 1), gl_InstanceID / 3 + (gl_VertexID >> 1));
    vec2 inner = clamp(view_position.xz + NEAR_BY * vec2(2 * corner - 3), -half_size, half_size);
    vec2 outer = half_size * vec2(sign(2 * corner - 3));
    at = mix(inner, outer, vec2(notEqual(abs(2 * corner - 3), ivec2(1))));
    from_viewer = vec3(at.x, height, at.y) - view_position;
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
}
