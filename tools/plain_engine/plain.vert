// Takes the vertices of many copies of a mesh from its frame to clip space.
#include "common/rotation.glsl"
#include "common/view.glsl"
in vec3 in_position;        // asset frame, metres
in vec3 in_normal;
in vec3 in_origin;          // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

out vec3 normal;
out vec3 from_viewer;

void main() {
    from_viewer = in_origin + in_scale * rotate(in_rotation, in_position);
    normal = rotate(in_rotation, in_normal);
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
}
