// Blurs each pixel by rays to points of the lens. Where all circles of confusion are wide, the coarse picture has the result.
#include "dof/circle.glsl"
#from depthwalk.render.view.lens import LEAST_HALF, MIN_RAYS
uniform sampler2D lit_texture;      // as it was, linear filter
uniform sampler2D range_texture;    // the least and the greatest circle that may reach into a tile, and around it
uniform sampler2D gathered_texture;   // of `reduced`, linear filter
uniform sampler2D circles_texture;
uniform int tile_side;
uniform int samples;
layout(location = 0) out vec4 lit;

ivec2 picture_size() { return textureSize(depth_texture, 0); }
#include "dof/rays.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 range = texelFetch(range_texture, pixel / tile_side, 0);
    if (max(-range.x, range.y) < SHARP_RADIUS) discard;
    vec2 size = vec2(picture_size());
    float own = circle_at(pixel);
    float radius = max(-range.x, own);
    if (radius < SHARP_RADIUS) discard;
    if (abs(own) >= LEAST_HALF) {
        vec2 at = gl_FragCoord.xy / 2.0 - 0.5;
        ivec2 low = ivec2(floor(at)), last = textureSize(gathered_texture, 0) - 1;
        vec2 part = at - vec2(low);
        lit = vec4(0.0);
        float total = 0.0;
        for (int k = 0; k < 4; ++k) {
            ivec2 corner = ivec2(k & 1, k >> 1), texel = clamp(low + corner, ivec2(0), last);
            vec2 near = mix(1.0 - part, part, vec2(corner));
            float weight = abs(texelFetch(circles_texture, texel, 0).r) >= 0.75 * LEAST_HALF ? near.x * near.y : 0.0;
            lit += weight * texelFetch(gathered_texture, texel, 0);
            total += weight;
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
