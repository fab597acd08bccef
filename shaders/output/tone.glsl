// Maps light of any strength to the range of a screen, both linear (tone mapping). Twin: reference/tone.py.
#from depthwalk.colour import LUMINANCE
#if defined(REINHARD)
// Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", equation 3.
vec3 tone(vec3 c) { return c / (1.0 + dot(c, LUMINANCE)); }
#elif defined(ACES)
// Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
vec3 tone(vec3 c) { return c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14); }
#elif defined(AGX)
// AgX (Sobotka 2022) as Wrensch 2023, "Minimal AgX Implementation", fits it: in a narrower space, over 16.5 EV, a curve.
const mat3 INTO = mat3(0.842479062253094, 0.0423282422610123, 0.0423756549057051, 0.0784335999999992, 0.878468636469772,
                       0.0784336, 0.0792237451477643, 0.0791661274605434, 0.879142973793104);
const mat3 BACK = mat3(1.19687900512017, -0.0528968517574562, -0.0529716355114438, -0.0980208811401368,
                       1.15190312990417, -0.0980434501171241, -0.0990297440797205, -0.0989611768448433,
                       1.15107367264116);
const float DARKEST = -12.47393, BRIGHTEST = 4.026069;  // log2

vec3 tone(vec3 c) {
    vec3 x = clamp((log2(max(INTO * c, 1e-10)) - DARKEST) / (BRIGHTEST - DARKEST), 0.0, 1.0);
    vec3 x2 = x * x, x4 = x2 * x2;
    vec3 curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return pow(max(BACK * curve, 0.0), vec3(2.2));
}
#else
vec3 tone(vec3 c) { return c; }
#endif
