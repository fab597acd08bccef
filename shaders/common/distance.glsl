// Converts depth-buffer values to metres along the view axis, and back.
#include "common/view.glsl"
uniform sampler2D depth_texture;

float distance_of(float depth) {
    return depth_range.x * depth_range.y / (depth_range.y - depth * (depth_range.y - depth_range.x));
}
float depth_of(float distance) {
    return (depth_range.y - depth_range.x * depth_range.y / distance) / (depth_range.y - depth_range.x);
}
float distance_at(ivec2 pixel) { return distance_of(texelFetch(depth_texture, pixel, 0).r); }

// As far behind `distance` as so many pixels are wide there. What is OUTLINE behind a surface does not belong to it.
const float OUTLINE = 2.0;
float behind(float distance, float pixels) { return distance * (1.0 + pixels * pixel_angle); }
