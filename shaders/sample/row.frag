// Copies the samples of one pixel side by side.
uniform sampler2DMS samples;

layout(location = 0) out vec2 at;

void main() { at = texelFetch(samples, ivec2(0), int(gl_FragCoord.x)).xy; }
