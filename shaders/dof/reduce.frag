// Reduces a picture to half of its width and height: for each block of four pixels, circle of confusion and mean colour of the
// surface that covers most of it. Surfaces are not mixed, so that sharp ones do not bleed into blurred ones; where circles
// hardly differ, all four pixels count, as those of one surface seen at a slant.
// FIRST: the picture itself, whose circles follow from the depth buffer. Twin: reference/dof_tiles.py.
#from depthwalk.render.view.lens import ONE_SURFACE
uniform sampler2D sharp_texture;    // unfiltered, read at pixel centres: texelFetch takes software twice as long
#ifdef FIRST
#include "dof/circle.glsl"
#else
uniform sampler2D circles_texture;
#endif
layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 circles;  // of that surface; the least and the greatest of the block; pixels of the picture

float least_of(vec4 of) { return min(min(of.x, of.y), min(of.z, of.w)); }
float greatest_of(vec4 of) { return max(max(of.x, of.y), max(of.z, of.w)); }

void main() {
    vec2 texel = 1.0 / vec2(textureSize(sharp_texture, 0)), low = (2.0 * gl_FragCoord.xy - 0.5) * texel;
    // Beyond the edge of a picture of odd size its last pixels are repeated, as the texture is clamped.
    vec2 right = low + vec2(texel.x, 0.0), above = low + vec2(0.0, texel.y), high = low + texel;
#ifdef FIRST
    vec4 found = vec4(circle_of(textureLod(depth_texture, low, 0.0).r), circle_of(textureLod(depth_texture, right, 0.0).r),
                      circle_of(textureLod(depth_texture, above, 0.0).r), circle_of(textureLod(depth_texture, high, 0.0).r));
    float nearest = least_of(found), farthest = greatest_of(found), least = nearest, greatest = farthest;
#else
    vec3 lower = textureLod(circles_texture, low, 0.0).xyz, lower_right = textureLod(circles_texture, right, 0.0).xyz;
    vec3 upper = textureLod(circles_texture, above, 0.0).xyz, upper_right = textureLod(circles_texture, high, 0.0).xyz;
    vec4 found = vec4(lower.x, lower_right.x, upper.x, upper_right.x);
    float nearest = least_of(found), farthest = greatest_of(found);
    float least = least_of(vec4(lower.y, lower_right.y, upper.y, upper_right.y));
    float greatest = greatest_of(vec4(lower.z, lower_right.z, upper.z, upper_right.z));
#endif
    float limit = farthest - nearest < ONE_SURFACE ? nearest : 0.5 * (nearest + farthest);
    vec4 weight = step(limit, found);  // 1 for what is farther
    float count = dot(weight, vec4(1.0));
    if (count <= 2.0) weight = 1.0 - weight;
    weight /= count <= 2.0 ? 4.0 - count : count;
    colour = weight.x * textureLod(sharp_texture, low, 0.0) + weight.y * textureLod(sharp_texture, right, 0.0) +
             weight.z * textureLod(sharp_texture, above, 0.0) + weight.w * textureLod(sharp_texture, high, 0.0);
    circles = vec4(dot(weight, found), least, greatest, 0.0);
}
