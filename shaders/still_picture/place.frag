// Puts one picture into another, with its lower left corner in a given place.
uniform sampler2D picture;
uniform ivec2 corner;       // pixels

layout(location = 0) out vec4 colour;

void main() { colour = texelFetch(picture, ivec2(gl_FragCoord.xy) - corner, 0); }
