// Adds the contribution of a sample to the picture, in linear light.
uniform sampler2D lit_texture;
uniform int samples;

layout(location = 0) out vec4 part;

void main() { part = texelFetch(lit_texture, ivec2(gl_FragCoord.xy), 0) / float(samples); }
