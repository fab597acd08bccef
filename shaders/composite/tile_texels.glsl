// Reads the impostor tile of a rectangle: stored depths, and which of them belong to one surface.
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
    depth.x = texelFetch(atlas_depth, low + ivec2(0, 1), 0).r;
    depth.y = texelFetch(atlas_depth, low + ivec2(1, 1), 0).r;
    depth.z = texelFetch(atlas_depth, low + ivec2(1, 0), 0).r;
    depth.w = texelFetch(atlas_depth, low, 0).r;
    return depth;
#endif
}

#ifdef LIT
// The light between these texels, by weights that need not sum up to 1. What empty texels hold counts for nothing.
vec4 light_between(ivec2 low, vec4 weight) {
    vec4 sum = weight.x * texelFetch(atlas_light, low + ivec2(0, 1), 0);
    sum += weight.y * texelFetch(atlas_light, low + ivec2(1, 1), 0);
    sum += weight.z * texelFetch(atlas_light, low + ivec2(1, 0), 0);
    sum += weight.w * texelFetch(atlas_light, low, 0);
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
