// Finds the points that texels of the ambient visibility show: every second pixel of every second row, from the viewer, world.
#include "common/distance.glsl"

ivec2 shown_pixel(ivec2 texel) { return min(2 * texel, textureSize(depth_texture, 0) - 1); }

vec3 ray_through(ivec2 pixel) {
    return ray_from_screen * vec3((vec2(pixel) + 0.5) / vec2(textureSize(depth_texture, 0)) * 2.0 - 1.0, 1.0);
}

vec3 seen_point(ivec2 pixel, float distance) { return ray_through(pixel) * distance; }
vec3 seen_point(ivec2 pixel) { return seen_point(pixel, distance_at(pixel)); }
