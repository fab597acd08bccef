// Writes the mean of a pixel's samples, in linear light, and the depth of the nearest.
uniform sampler2D mean_texture;
uniform sampler2DMS depth_samples;
uniform int samples;

layout(location = 0) out vec4 lit;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    lit = texelFetch(mean_texture, pixel, 0);
    gl_FragDepth = 1.0;
    for (int k = 0; k < samples; ++k) gl_FragDepth = min(gl_FragDepth, texelFetch(depth_samples, pixel, k).r);
}
