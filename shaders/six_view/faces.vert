// One of the six views: which triangle of the mesh each texel sees.
uniform mat4 clip_from_object;
in vec3 in_position;

void main() { gl_Position = clip_from_object * vec4(in_position, 1.0); }
