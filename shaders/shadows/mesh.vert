// Projects polygons to the clip space of a shadow map, whose centre stands in for the viewer.
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec3 in_position;    // asset frame, metres
in vec3 in_origin;      // of the object, world, relative to the map's centre
in vec4 in_rotation;
in float in_scale;

void main() { gl_Position = clip_from_eye * vec4(in_origin + in_scale * rotate(in_rotation, in_position), 1.0); }
