// Computes the part of the sun's light that reaches a pixel's surface, 0 to 1, in world space, from the shadow maps
// (sun_maps.glsl).
#include "common/gbuffer.glsl"
#include "common/pixel.glsl"
#include "common/sun_maps.glsl"

void draw_sun(inout Pixel pixel) {
#ifdef SKY
    pixel.shadow = 1.0;
#else
    pixel.shadow = sun_share_at(pixel.ray, distance_of(pixel.depth), normal_of(pixel.surface));
#endif
}
