// Converts linear, premultiplied light to sRGB (IEC 61966-2-1) with alpha apart.
// SUPERSAMPLED: of a square of texels, whose mean is shown.
#include "common/pixel.glsl"
#include "output/tone.glsl"
uniform float exposure;
uniform int samples;    // per pixel, along either axis

// What the screen shows of a texel, linear, not premultiplied. What is too bright is white before it is averaged.
vec4 shown_of(vec4 lit) {
    return vec4(clamp(tone(exposure * lit.rgb / max(lit.a, 1e-4)), 0.0, 1.0), lit.a);
}

// The power of 1 / 2.4 is fitted, 4e-5 off at most: two roots take software rasterisers a quarter of the time.
vec3 encode(vec3 c) {
    vec3 root = sqrt(c), fourth = sqrt(root);
    vec3 curve = (1.122681 - 0.335501 * fourth) * root + 0.196136 * fourth + 0.08133 * c - 0.064612;
    return mix(c * 12.92, curve, step(0.0031308, c));
}

void draw_output(inout Pixel pixel) {
#ifdef SUPERSAMPLED
    vec4 sum = vec4(0.0);
    for (int k = 0; k < samples * samples; ++k) {
        ivec2 texel = ivec2(gl_FragCoord.xy) * samples + ivec2(k % samples, k / samples);
        vec4 shown = shown_of(texelFetch(lit_texture, texel, 0));
        sum += vec4(shown.rgb * shown.a, shown.a);
    }
    vec4 shown = vec4(sum.rgb / max(sum.a, 1e-4), sum.a / float(samples * samples));
#else
    vec4 shown = shown_of(pixel.lit);
#endif
    pixel.screen = vec4(encode(shown.rgb), shown.a);
}
