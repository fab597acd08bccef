// Takes the vertices of one mesh from its frame to clip space.
#include "common/rotation.glsl"
#include "common/view.glsl"
uniform vec3 origin;        // of the object, world, relative to the viewer
uniform vec4 rotation;
uniform float scale;

in vec3 in_position;        // asset frame, metres
in vec3 in_normal;

out vec3 normal;
out vec3 from_viewer;

void main() {
    from_viewer = origin + scale * rotate(rotation, in_position);
    normal = rotate(rotation, in_normal);
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
}
