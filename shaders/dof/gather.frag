// Traces rays from each pixel to points of the lens. Where its own circle of confusion is wide, it takes what was gathered in
// the picture of half the size instead, but not from pixels there that are sharp. Twin: reference/dof.py.
#from depthwalk.render.view.lens import SHARP_RADIUS, RAY_DENSITY, LEAST_HALF, NEARLY, MIN_RAYS
#include "dof/circle.glsl"
uniform sampler2D lit_texture;      // as it was, linear filter
uniform sampler2D range_texture;    // the least and the greatest circle that may reach into a tile, and around it
uniform sampler2D gathered_texture; // of `reduced`, half as wide and high
uniform sampler2D circles_texture;  // of `reduce`, likewise
uniform int tile_side;
uniform int samples;
layout(location = 0) out vec4 lit;

ivec2 picture_size() { return textureSize(depth_texture, 0); }
#include "dof/rays.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 range = texelFetch(range_texture, pixel / tile_side, 0);
    vec2 size = vec2(picture_size());
    float own = circle_at(pixel);
    float radius = max(-range.x, own);
    if (radius < SHARP_RADIUS) discard;
    if (abs(own) >= LEAST_HALF) {
        vec2 at = 0.5 * gl_FragCoord.xy - 0.5;
        ivec2 low = ivec2(floor(at)), last = textureSize(gathered_texture, 0) - 1;
        vec2 part = at - vec2(low);
        lit = vec4(0.0);
        float total = 0.0;
        for (int k = 0; k < 4; ++k) {
            ivec2 corner = ivec2(k & 1, k >> 1), texel = clamp(low + corner, ivec2(0), last);
            vec2 near = mix(1.0 - part, part, vec2(corner));
            if (abs(texelFetch(circles_texture, texel, 0).r) < NEARLY * LEAST_HALF) continue;  // not gathered there
            lit += near.x * near.y * texelFetch(gathered_texture, texel, 0);
            total += near.x * near.y;
        }
        if (total > 0.01) {
            lit /= total;
            return;
        }
    }
    int count = clamp(int(RAY_DENSITY * radius * radius), min(MIN_RAYS, samples), samples);
    vec4 sum = vec4(0.0);
    vec2 towards = vec2(inversesqrt(float(count)), 0.0);
    float total = 0.0;
    for (int k = 0; k < count; ++k, towards = TURN * towards) {
        vec3 end = traced(pixel, sqrt(float(k) + 0.5) * towards, own, range.xy);
        sum += end.z * textureLod(lit_texture, end.xy / size, 0.0);
        total += end.z;
    }
    lit = sum / total;
}
