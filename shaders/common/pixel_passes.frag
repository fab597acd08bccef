// Draws a pixel by the functions of passes that follow each other: DRAW_PASSES calls them, RESULT is what the last one draws.
// SURFACES, SKY: only pixels that show something, or nothing; TESTED: a test of the depth has found them already.
// READS_…: which targets they read that none of them draws; nearest texels, see texel.glsl.
#include "common/pixel.glsl"

in vec2 uv;
in vec3 ray;
layout(location = 0) out vec4 result;

void main() {
    Pixel pixel;
    pixel.uv = uv;
    pixel.ray = ray;
#ifdef READS_DEPTH
    pixel.depth = textureLod(depth_texture, uv, 0.0).r;
#ifndef TESTED
#if defined SKY
    if (pixel.depth < 1.0) discard;
#elif defined SURFACES
    if (pixel.depth == 1.0) discard;
#endif
#endif
#endif
#ifdef READS_ALBEDO
    pixel.albedo = textureLod(albedo_texture, uv, 0.0);
#endif
#ifdef READS_SURFACE
    pixel.surface = textureLod(surface_texture, uv, 0.0);
#endif
#ifdef READS_SHADOW
    pixel.shadow = textureLod(shadow_texture, uv, 0.0).r;
#endif
#ifdef READS_LIT
    pixel.lit = textureLod(lit_texture, uv, 0.0);
#endif
    DRAW_PASSES
    result = RESULT;
}
