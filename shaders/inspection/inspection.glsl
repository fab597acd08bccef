// Shows the inputs of lighting instead of light: normals, distances or albedo. Twin: reference/inspection.py.
#include "common/gbuffer.glsl"
#include "common/pixel.glsl"
#include "common/srgb.glsl"
uniform float half_distance;

void draw_inspection(inout Pixel pixel) {
#if defined(SKY) && defined(TRANSPARENT)
    pixel.lit = vec4(0.0);
#elif defined(SKY)
    pixel.lit = vec4(0.0, 0.0, 0.0, 1.0);
#elif defined(NORMALS)
    pixel.lit = vec4(linear_from_srgb(0.5 + 0.5 * normal_of(pixel.surface)), 1.0);
#elif defined(DISTANCE)
    pixel.lit = vec4(linear_from_srgb(vec3(exp2(-distance_of(pixel.depth) / half_distance))), 1.0);
#else
    pixel.lit = vec4(albedo_of(pixel.surface), 1.0);
#endif
}
