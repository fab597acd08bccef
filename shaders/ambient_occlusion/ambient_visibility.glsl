// Interpolates the ambient visibility at a pixel, from texels of the same surface, and the ambient light that it lets through.
#include "ambient_occlusion/neighbour.glsl"

// The part of the ambient light that reaches a surface. point: from the viewer, world.
float ambient_visibility_at(vec3 point, vec3 normal) {
    ivec2 pixel = ivec2(gl_FragCoord.xy), texel = pixel >> 1;
    vec2 part = 0.5 * vec2(pixel & 1);
    vec2 total = (1.0 - part.x) * (1.0 - part.y) * weighted_visibility(texel, point, normal);
    total += part.x * (1.0 - part.y) * weighted_visibility(texel + ivec2(1, 0), point, normal);
    total += (1.0 - part.x) * part.y * weighted_visibility(texel + ivec2(0, 1), point, normal);
    total += part.x * part.y * weighted_visibility(texel + 1, point, normal);
    return total.x / total.y;
}

// What reaches a surface with the light that those around it reflect, if they have its colour (Jimenez et al. 2016, §6).
vec3 with_reflected(float visibility, vec3 albedo) {
    vec3 cubic = 2.0404 * albedo - 0.3324, square = -4.7951 * albedo + 0.6417, linear = 2.7552 * albedo + 0.6903;
    return max(vec3(visibility), ((visibility * cubic + square) * visibility + linear) * visibility);
}
