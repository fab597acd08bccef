// Takes the panel's triangles from window coordinates, from the top left, to clip space.
uniform vec2 display_size;

in vec2 in_position;
in vec2 in_uv;
in vec4 in_colour;

out vec2 uv;
out vec4 colour;

void main() {
    uv = in_uv;
    colour = in_colour;
    gl_Position = vec4(in_position / display_size * vec2(2.0, -2.0) + vec2(-1.0, 1.0), 0.0, 1.0);
}
