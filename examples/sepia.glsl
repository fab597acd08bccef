// Tints the lit picture, keeping its luminance.
#include "common/pixel.glsl"
uniform vec3 tint;

void draw_sepia(inout Pixel pixel) {
    float luminance = dot(pixel.lit.rgb, vec3(0.2126, 0.7152, 0.0722));
    pixel.lit.rgb = luminance * tint;
}
