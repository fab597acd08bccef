// Adds less than half a step of 8 bits to colours of the screen, by a pattern over its pixels: without it, gradients have bands.
// DITHER: do so. EVEN_SKY: not to a background of one colour. REDUCED: pixels here are not those of the screen, and are left for
// later. Twin: reference/dither.py.
#from depthwalk.render.passes.output import DITHER_AMPLITUDE, NOISE_ACROSS, NOISE_UP, NOISE_FACTOR
vec3 dithered(vec3 screen) {
#if defined(DITHER) && !defined(EVEN_SKY) && !defined(REDUCED)
    float noise = fract(NOISE_FACTOR * fract(dot(gl_FragCoord.xy, vec2(NOISE_ACROSS, NOISE_UP))));
    return screen + (noise - 0.5) * (2.0 * DITHER_AMPLITUDE / 255.0);
#else
    return screen;
#endif
}
