// Transforms polygons, instanced, to clip space as mesh.vert does, and numbers the instances.
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec3 in_position;    // asset frame, metres
in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;
uniform int first;      // number of the first instance among all that the frame draws

flat out uint number;

void main() {
    number = uint(first + gl_InstanceID);
    gl_Position = clip_from_eye * vec4(in_origin + in_scale * rotate(in_rotation, in_position), 1.0);
}
