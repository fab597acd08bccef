// Draws a pixel by the functions of passes that follow each other: DRAW_PASSES calls them, RESULT is what the last one draws.
// SURFACES, SKY: only pixels that show something, or nothing; TESTED: a test of the depth has found them already.
// READS_…: which targets they read that none of them draws.
#include "common/pixel.glsl"

in vec2 uv;
in vec3 ray;
layout(location = 0) out vec4 result;

void main() {
    Pixel pixel;
    pixel.uv = uv;
    pixel.ray = ray;
    ivec2 here = ivec2(gl_FragCoord.xy);
#ifdef READS_DEPTH
    pixel.depth = texelFetch(depth_texture, here, 0).r;
#ifndef TESTED
#if defined SKY
    if (pixel.depth < 1.0) discard;
#elif defined SURFACES
    if (pixel.depth == 1.0) discard;
#endif
#endif
#endif
#ifdef READS_SURFACE
    pixel.surface = texelFetch(surface_texture, here, 0).xy;
#endif
#ifdef READS_SHADOW
    pixel.shadow = texelFetch(shadow_texture, here, 0).r;
#endif
#ifdef READS_LIT
    pixel.lit = texelFetch(lit_texture, here, 0);
#endif
    DRAW_PASSES
    result = RESULT;
}
