// Writes how far ahead of a camera that has moved the picture's nearest surface is in each cell of the screen, metres, and with
// MOVED by how much it has moved by itself.
flat in float ahead;
flat in vec3 shift;
layout(location = 0) out vec4 nearest;

void main() { nearest = vec4(ahead, shift); }
