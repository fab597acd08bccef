// Projects the mesh, from the object frame to clip space of one of the six views, to find which triangle each texel sees (Liu,
// Liu and Wu 2007, §3.1).
uniform mat4 clip_from_object;
in vec3 in_position;

void main() { gl_Position = clip_from_object * vec4(in_position, 1.0); }
