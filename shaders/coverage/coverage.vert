// The part of the picture in which depth images are.
uniform vec2 low;           // corners, −1 to 1
uniform vec2 high;

void main() {
    gl_Position = vec4(mix(low, high, vec2(gl_VertexID & 1, gl_VertexID >> 1)), 0.0, 1.0);
}
