// Copies one sample of each pixel from the multisampled targets.
uniform usampler2DMS surface_samples;
uniform usampler2DMS visibility_samples;
uniform sampler2DMS depth_samples;
uniform int number;
#ifdef LIT
uniform sampler2DMS tile_light_samples;
layout(location = 2) out vec4 tile_light;
#endif

layout(location = 0) out uvec2 surface;
layout(location = 1) out uvec2 visibility;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface = texelFetch(surface_samples, pixel, number).xy;
    visibility = texelFetch(visibility_samples, pixel, number).xy;
#ifdef LIT
    tile_light = texelFetch(tile_light_samples, pixel, number);
#endif
    gl_FragDepth = texelFetch(depth_samples, pixel, number).r;
}
