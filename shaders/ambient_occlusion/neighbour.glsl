// Weighs texels of the ambient visibility by whether they show the same surface as a pixel.
#include "ambient_occlusion/seen_point.glsl"
uniform sampler2D ambient_visibility;   // part of the light; metres along the view axis, half as wide and high as the picture
uniform float off_surface;              // metres off a surface's plane from which on a point belongs to another one

// x: the visibility of `texel` times its weight, y: the weight. point, normal: of the pixel.
vec2 weighted_visibility(ivec2 texel, vec3 point, vec3 normal) {
    ivec2 inside = clamp(texel, ivec2(0), textureSize(ambient_visibility, 0) - 1);
    vec2 found = texelFetch(ambient_visibility, inside, 0).xy;
    vec3 beside = seen_point(shown_pixel(inside), found.y) - point;
    float weight = clamp(1.0 - abs(dot(normal, beside)) / off_surface, 0.0, 1.0) + 1e-4;
    return vec2(found.x * weight, weight);
}
