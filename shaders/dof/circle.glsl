// Computes circles of confusion from the depth buffer, in pixels (Huang et al. 2008, formulas 1 and 2). They are affine in
// depth, as 1 over the distance is. Twin: `circle_radius` of render/view/lens.py.
#include "common/distance.glsl"
uniform vec3 circle_from_depth;     // radius at depth 0, pixels; its increase up to depth 1; radius of the sky
uniform float largest;              // radius, pixels

float circle_of(float depth) {
    float radius = depth < 1.0 ? circle_from_depth.x + depth * circle_from_depth.y : circle_from_depth.z;
    return clamp(radius, -largest, largest);
}
// Radius in pixels, negative in front of the focus.
float circle_at(ivec2 pixel) { return circle_of(texelFetch(depth_texture, pixel, 0).r); }
