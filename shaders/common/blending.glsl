// Reads and writes pixels that are blended with each other, in linear light, premultiplied. They are those of the lit picture
// or, with SHOWN, of the finished one, in which pixels that are too bright are white already.
uniform sampler2D before_texture;   // the picture as it was

#ifdef SHOWN
#include "common/srgb.glsl"
vec4 pixel_before(ivec2 pixel) {
    vec4 shown = texelFetch(before_texture, pixel, 0);
    return vec4(linear_from_srgb(shown.rgb) * shown.a, shown.a);
}
vec4 written(vec4 blended) { return vec4(srgb_from_linear(blended.rgb / max(blended.a, 1e-4)), blended.a); }
#else
vec4 pixel_before(ivec2 pixel) { return texelFetch(before_texture, pixel, 0); }
vec4 written(vec4 blended) { return blended; }
#endif
