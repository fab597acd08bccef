// Reads the impostor tile of a rectangle: stored depths, and which of them belong to one surface.
#include "common/texel.glsl"
uniform sampler2D atlas_depth;      // 1 − nearest·λ/w, 1 where empty
uniform usampler2D atlas_owner;
#ifdef LIT
uniform sampler2D atlas_light;      // linear
#endif

flat in uint objects;               // how many the tile shows
flat in vec4 tile;                  // x, y, width, height in texels

// Stored depths of the texels at `low` + (0,1) (1,1) (1,0) (0,0).
vec4 four_depths(ivec2 low) {
#ifdef TEXTURE_GATHER
    return textureGather(atlas_depth, (vec2(low) + 1.0) / vec2(textureSize(atlas_depth, 0)));
#else
    vec4 depth;
    depth.x = texel_at(atlas_depth, low + ivec2(0, 1)).r;
    depth.y = texel_at(atlas_depth, low + ivec2(1, 1)).r;
    depth.z = texel_at(atlas_depth, low + ivec2(1, 0)).r;
    depth.w = texel_at(atlas_depth, low).r;
    return depth;
#endif
}

#ifdef LIT
// The light between these texels, by weights that need not sum up to 1. What empty texels hold counts for nothing.
vec4 light_between(ivec2 low, vec4 weight) {
    vec4 sum = weight.x * texel_at(atlas_light, low + ivec2(0, 1));
    sum += weight.y * texel_at(atlas_light, low + ivec2(1, 1));
    sum += weight.z * texel_at(atlas_light, low + ivec2(1, 0));
    sum += weight.w * texel_at(atlas_light, low);
    return sum / dot(weight, vec4(1.0));
}
#endif

// Texels continue one surface where their λ differs by less than this many pixels' worth: from one to the next, it is less
// than 8 times as deep as wide.
const float MAX_SLOPE = 8.0;

// How much the stored depth of a texel may differ from `stored` if it continues the same surface.
float depth_tolerance(float stored) {
    return MAX_SLOPE * pixel_angle * (1.0 - stored);
}
