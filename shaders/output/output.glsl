// Converts linear, premultiplied light to sRGB (IEC 61966-2-1) with straight alpha.
// SAMPLES: shows the mean of a square of texels, so many along either axis.
#include "common/pixel.glsl"
#include "common/dither.glsl"
#include "common/srgb.glsl"
#include "output/tone.glsl"
#from depthwalk.render.target_table import MOST_LIGHT
uniform float exposure;

// What the screen shows of a texel, linear, not premultiplied; clipped to white before it is averaged.
vec4 shown_of(vec4 lit) {
    return vec4(clamp(tone(exposure * min(lit.rgb, MOST_LIGHT) / max(lit.a, 1e-4)), 0.0, 1.0), lit.a);     // no infinity
}

void draw_output(inout Pixel pixel) {
#ifdef SAMPLES
    vec4 sum = vec4(0.0);
    for (int k = 0; k < SAMPLES * SAMPLES; ++k) {
        ivec2 texel = ivec2(gl_FragCoord.xy) * SAMPLES + ivec2(k % SAMPLES, k / SAMPLES);
        vec4 shown = shown_of(texelFetch(lit_texture, texel, 0));
        sum += vec4(shown.rgb * shown.a, shown.a);
    }
    vec4 shown = vec4(sum.rgb / max(sum.a, 1e-4), sum.a / float(SAMPLES * SAMPLES));
#else
    vec4 shown = shown_of(pixel.lit);
#endif
    pixel.screen = vec4(dithered(srgb_from_linear(shown.rgb)), shown.a);
}
