// Multiplies the panel's vertex colours by its font texture, in sRGB.
uniform sampler2D image;
in vec2 uv;
in vec4 colour;
layout(location = 0) out vec4 screen;

void main() { screen = colour * texture(image, uv); }
