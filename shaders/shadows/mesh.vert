// Polygons into a shadow map.
#include "common/rotation.glsl"
uniform mat4 clip_from_centre;

in vec3 in_position;    // asset frame, metres
in vec3 in_origin;      // of the object, world, relative to the map's centre
in vec4 in_rotation;
in float in_scale;

void main() { gl_Position = clip_from_centre * vec4(in_origin + in_scale * rotate(in_rotation, in_position), 1.0); }
