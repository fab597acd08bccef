// Traces rays from each pixel to points of the lens. Where its own circle of confusion is wide, it uses the result from the
// picture of half the size instead, but not of pixels there that are sharp. Twin: reference/dof.py.
#from depthwalk.render.view.lens import SHARP_RADIUS, RAY_DENSITY, LEAST_HALF, NEARLY, MIN_RAYS
#include "dof/circle.glsl"
#include "dof/passed_on.glsl"
#include "common/dither.glsl"
uniform sampler2D sharp_texture;    // the picture as it was, linear filter
uniform sampler2D range_texture;    // the least and the greatest circle that may reach into a tile, and around it
uniform sampler2D gathered_texture; // of `reduced`, half as wide and high, passed on already
uniform sampler2D circles_texture;  // of `reduce`, likewise
uniform int tile_side;
uniform int most_rays;

float circle_near(vec2 at) { return circle_of(textureLod(depth_texture, at / vec2(textureSize(depth_texture, 0)), 0.0).r); }
#include "dof/rays.glsl"

// The result gathered there about the pixel; a: its weight, 0 where there is none.
vec4 gathered(out float total) {
    vec2 at = 0.5 * gl_FragCoord.xy - 0.5;
    ivec2 low = ivec2(floor(at)), last = textureSize(gathered_texture, 0) - 1;
    vec2 part = at - vec2(low);
    vec4 sum = vec4(0.0);
    total = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(k & 1, k >> 1), texel = clamp(low + corner, ivec2(0), last);
        vec2 near = mix(1.0 - part, part, vec2(corner));
        if (abs(texelFetch(circles_texture, texel, 0).r) < NEARLY * LEAST_HALF) continue;  // not gathered there
        sum += near.x * near.y * texelFetch(gathered_texture, texel, 0);
        total += near.x * near.y;
    }
    return sum;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 range = texelFetch(range_texture, pixel / tile_side, 0);
    vec2 size = vec2(textureSize(depth_texture, 0));
    float own = circle_at(pixel), radius = max(-range.x, own), covered = 0.0;
    if (radius >= SHARP_RADIUS && abs(own) >= LEAST_HALF) {
        vec4 found = gathered(covered);
        if (covered > 0.01) {
            result = found / covered;
            result.rgb = dithered(result.rgb);
            return;
        }
    }
    vec4 sum = vec4(0.0);
    float total = 0.0;
    if (radius < SHARP_RADIUS) {
        sum = texelFetch(sharp_texture, pixel, 0);
        total = 1.0;
    } else {
        int count = clamp(int(RAY_DENSITY * radius * radius), min(MIN_RAYS, most_rays), most_rays);
        vec2 towards = vec2(inversesqrt(float(count)), 0.0);
        for (int k = 0; k < count; ++k, towards = TURN * towards) {
            vec3 end = traced(gl_FragCoord.xy, sqrt(float(k) + 0.5) * towards, own, range.xy);
            sum += end.z * textureLod(sharp_texture, end.xy / size, 0.0);
            total += end.z;
        }
    }
    result = passed_on(sum / total);
}
