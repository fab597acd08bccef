// Linear, premultiplied, to sRGB (IEC 61966-2-1) with alpha apart.
#include "output/tone.glsl"
uniform sampler2D lit_texture;
uniform float exposure;
uniform int samples;    // per pixel, along either axis

layout(location = 0) out vec4 screen;

vec4 lit_at(ivec2 texel) {
    vec4 lit = texelFetch(lit_texture, texel, 0);
    // What is too bright is white before it is averaged.
    return vec4(clamp(tone(exposure * lit.rgb / max(lit.a, 1e-4)), 0.0, 1.0) * lit.a, lit.a);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#ifdef SUPERSAMPLED
    vec4 lit = vec4(0.0);
    for (int k = 0; k < samples * samples; ++k) lit += lit_at(pixel * samples + ivec2(k % samples, k / samples));
    lit /= float(samples * samples);
#else
    vec4 lit = lit_at(pixel);
#endif
    vec3 c = clamp(lit.rgb / max(lit.a, 1e-4), 0.0, 1.0);
    vec3 encoded = mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
    screen = vec4(encoded, lit.a);
}
