// Reduces a picture to half of its width and height: of each block of four pixels the surface that covers most of it, its
// circle of confusion and its mean colour. Surfaces are not mixed, so that what is sharp does not run into what is blurred.
// FIRST: the picture itself, whose circles follow from the depth buffer. Twin: reference/dof.py.
#ifdef FIRST
#include "dof/circle.glsl"
vec3 circles_at(ivec2 pixel) { return vec3(circle_at(pixel)); }
#else
uniform sampler2D circles_texture;
vec3 circles_at(ivec2 pixel) { return texelFetch(circles_texture, pixel, 0).xyz; }
#endif
uniform sampler2D lit_texture;
layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 circles;  // of that surface; the least and the greatest of the block; pixels of the picture

void main() {
    ivec2 low = 2 * ivec2(gl_FragCoord.xy), high = min(low + 1, textureSize(lit_texture, 0) - 1);
    ivec2 pixel[4] = ivec2[4](low, ivec2(high.x, low.y), ivec2(low.x, high.y), high);
    vec3 found[4] = vec3[4](circles_at(pixel[0]), circles_at(pixel[1]), circles_at(pixel[2]), circles_at(pixel[3]));
    float nearest = min(min(found[0].x, found[1].x), min(found[2].x, found[3].x));
    float farthest = max(max(found[0].x, found[1].x), max(found[2].x, found[3].x));
    float middle = 0.5 * (nearest + farthest), farther = 0.0;
    for (int k = 0; k < 4; ++k) farther += step(middle, found[k].x);
    colour = vec4(0.0);
    float own = 0.0, count = 0.0;
    for (int k = 0; k < 4; ++k) {
        float weight = (found[k].x >= middle) == (farther > 2.0) ? 1.0 : 0.0;
        colour += weight * texelFetch(lit_texture, pixel[k], 0);
        own += weight * found[k].x;
        count += weight;
    }
    colour /= count;
    circles.x = own / count;
    circles.y = min(min(found[0].y, found[1].y), min(found[2].y, found[3].y));
    circles.z = max(max(found[0].z, found[1].z), max(found[2].z, found[3].z));
    circles.w = 0.0;
}
