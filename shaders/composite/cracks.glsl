// Closes cracks in an impostor tile: empty texels between two of one surface, where one image's samples end and another's
// begin. Between two surfaces empty texels are a gap, the discontinuity cut, and stay open. Twin:
// reference/impostor_tile.py.
#include "composite/tile_texels.glsl"

// The depth that closes a crack between texels of two stored depths: the farther, or 1 where they are not of one surface.
float between(float one, float other) {
    float farther = max(one, other);
    return abs(one - other) <= depth_tolerance(farther) ? farther : 1.0;
}

// Looks across the empty texels from `low` to `high`, which are the same or, each in its row and column, beside each other.
// Gives the farther depth beyond them and moves `owner_texel` there, or 1 where there is no crack.
float across_crack(ivec2 low, ivec2 high, out ivec2 owner_texel) {
    float left = texel_at(atlas_depth, low - ivec2(1, 0)).r, right = texel_at(atlas_depth, high + ivec2(1, 0)).r;
    float below = texel_at(atlas_depth, low - ivec2(0, 1)).r, above = texel_at(atlas_depth, high + ivec2(0, 1)).r;
    vec2 first = vec2(low) - tile.xy, last = vec2(high) - tile.xy;
    bvec2 inside = bvec2(first.x >= 1.0 && last.x + 2.0 <= tile.z, first.y >= 1.0 && last.y + 2.0 <= tile.w);
    float across = inside.x ? between(left, right) : 1.0;
    float along = inside.y ? between(below, above) : 1.0;
    if (across <= along) owner_texel = left > right ? low - ivec2(1, 0) : high + ivec2(1, 0);
    else owner_texel = below > above ? low - ivec2(0, 1) : high + ivec2(0, 1);
    return min(across, along);
}
