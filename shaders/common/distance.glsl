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

// The distance that is behind `distance` by the width of `pixels` pixels there. A point SURFACE_GAP pixels behind a surface
// belongs to another one.
const float SURFACE_GAP = 2.0;
float behind(float distance, float pixels) { return distance * (1.0 + pixels * pixel_angle); }
