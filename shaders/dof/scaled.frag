// Multiplies a picture by a factor, in linear light: to add a frame to the sum, and for the mean of the frames so far.
uniform sampler2D picture;
uniform float factor;
layout(location = 0) out vec4 scaled;

void main() { scaled = texelFetch(picture, ivec2(gl_FragCoord.xy), 0) * factor; }
