// Writes the number of the triangle that a texel sees.
out vec2 face;  // its high and low 16 bits: a float holds only 24 exactly

void main() { face = vec2(gl_PrimitiveID >> 16, gl_PrimitiveID & 0xffff); }
