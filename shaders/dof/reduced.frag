// Gathers what rays from all over the lens hit, in a reduced picture. Twin: reference/dof.py.
// EVEN_TILES: all circles around are about equal, and no ray is traced.
#from depthwalk.render.view.lens import LEAST_HALF, NEARLY, REDUCED_RAYS, EVEN_RAYS, MIP_RADIUS, LINEAR_BLUR
uniform sampler2D colour_texture;   // of `reduce`, linear filter
uniform sampler2D circles_texture;
uniform sampler2D range_texture;
uniform float block;                // pixels of the whole picture along a pixel of this one
uniform float highest_mip;          // of the colours
uniform int most_rays;
uniform int tile_side;              // of this picture's pixels
#include "dof/passed_on.glsl"

float circle_near(vec2 at) { return textureLod(circles_texture, at / vec2(textureSize(circles_texture, 0)), 0.0).r / block; }
#include "dof/rays.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float own = texelFetch(circles_texture, pixel, 0).r / block;
    if (abs(own) < NEARLY * LEAST_HALF / block) discard;
    vec2 size = vec2(textureSize(circles_texture, 0));
    vec4 sum = vec4(0.0);
#ifdef EVEN_TILES
    // The texels of level 2^l, their filter and the one that magnifies the result blur too: the disc shrinks by their variance.
    float level = clamp(floor(log2(abs(own) / MIP_RADIUS) + 1.0), 0.0, highest_mip), texel = exp2(level);
    float reach = sqrt(max(own * own - LINEAR_BLUR - texel * texel, 0.25 * own * own));
    int count = min(EVEN_RAYS, most_rays);
    vec2 towards = vec2(reach * inversesqrt(float(count)), 0.0);
    for (int k = 0; k < count; ++k, towards = TURN * towards)
        sum += textureLod(colour_texture, (gl_FragCoord.xy + sqrt(float(k) + 0.5) * towards) / size, level);
    float total = float(count);
#else
    vec2 range = texelFetch(range_texture, pixel / tile_side, 0).xy / block;
    int count = min(REDUCED_RAYS, most_rays);
    vec2 towards = vec2(inversesqrt(float(count)), 0.0);
    float total = 0.0;
    for (int k = 0; k < count; ++k, towards = TURN * towards) {
        vec3 end = traced(gl_FragCoord.xy, sqrt(float(k) + 0.5) * towards, own, range);
        sum += end.z * textureLod(colour_texture, end.xy / size, 0.0);
        total += end.z;
    }
#endif
    result = passed_on(sum / total);
}
