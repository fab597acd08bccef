// Writes where each sample of a pixel is, in parts of the pixel, 0 to 1.
#extension GL_ARB_sample_shading : require

layout(location = 0) out vec2 at;

void main() { at = gl_SamplePosition; }
