// Weighs the four texels of an impostor tile around a pixel: which of them make up the surface that the pixel shows, and, where
// PARTIAL, what part of the pixel they leave uncovered (docs/anti-aliasing.md). Texels are half a pixel wide then. Twin:
// reference/impostor_tile.py.
#include "composite/cracks.glsl"
#ifdef PARTIAL
const float STEEP = 0.3;            // of the depths that one surface may span from texel to texel
#endif
#ifdef LIT
vec4 tile_light_found;      // by `tile_depth`: linear light, filtered bilinearly as the paper's textures are (§2.5)
#endif

// Of texels that weigh the same but for rounding, as where pixels lie between half as wide ones, the right and upper owns.
const float TIE = 1e-3;

// The pixel's surface lies on the texels of `depth` at `low` + (0,1) (1,1) (1,0) (0,0), as far as their bilinear `weight` says;
// of empty ones it is 0. Returns whether any is left; if not, `stored` is what closes a crack, or 1, and `owner_texel` the
// texel that owns it. position: in texels, of the atlas.
bool is_covered(vec2 position, ivec2 low, vec4 depth, inout vec4 weight, out float stored, out ivec2 owner_texel) {
    stored = 1.0;
    owner_texel = low;
#ifdef PARTIAL
    float front = min(min(depth.x, depth.y), min(depth.z, depth.w));
    if (front == 1.0) {     // of texels half a pixel wide a crack takes two
        ivec2 high = min(low + 1, ivec2(tile.xy + tile.zw) - 1);
        stored = across_crack(low, high, owner_texel);
        return false;
    }
    weight *= step(depth - front, vec4(depth_tolerance(front)));      // of several surfaces the one in front
#else
    // The silhouette runs where half of the weight is on empty texels.
    if (dot(weight, vec4(1.0)) < 0.5) {
        ivec2 here = ivec2(floor(position + 0.5));
        if (objects == 1u) stored = across_crack(here, here, owner_texel);     // between two objects is no crack
        return false;
    }
#endif
    return true;
}

// Stored depth at `texel` of the atlas, 1 outside the silhouette; `owner_texel` owns the result, `uncovered` the
// part of the pixel that shows what is behind. `aside` is where the surface has that depth, pixels from the pixel's middle.
float tile_depth(vec2 texel, out ivec2 owner_texel, out float uncovered, out vec2 aside) {
    aside = vec2(0.0);
    vec2 position = clamp(texel, tile.xy + 0.5, tile.xy + tile.zw - 0.5) - 0.5;
    ivec2 low = ivec2(floor(position));
    vec2 f = position - vec2(low);
    vec4 depth = four_depths(low);
    vec4 weight = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y));
    depth = mix(depth, vec4(1.0), equal(weight, vec4(0.0)));    // at the border these may be the texels of the tile beside
    weight *= vec4(lessThan(depth, vec4(1.0)));
    uncovered = 0.0;
    float stored;
    if (!is_covered(position, low, depth, weight, stored, owner_texel)) {
#ifdef LIT
        tile_light_found = texel_at(atlas_light, owner_texel);
#endif
        return stored;
    }
#ifdef LIT
    tile_light_found = light_between(low, weight);
#endif
    // The heaviest that is not empty owns the pixel; of equals exactly one.
    vec2 left_right = vec2(max(weight.x, weight.w), max(weight.y, weight.z));
    bool right = left_right.y > left_right.x - TIE && left_right.y > 0.0;
    bool upper = right ? weight.y > weight.z - TIE && weight.y > 0.0 : weight.x > weight.w - TIE && weight.x > 0.0;
    owner_texel += ivec2(right, upper);
    float own = right ? (upper ? depth.y : depth.z) : (upper ? depth.x : depth.w);
    weight *= step(abs(depth - own), vec4(depth_tolerance(own)));
#ifdef PARTIAL
    uncovered = 1.0 - dot(weight, vec4(1.0));
    // The mean of depths lies on a surface that is flat between them. Of a steep one it may be far off, so one texel counts.
    vec4 deviation = abs(depth - own) * vec4(greaterThan(weight, vec4(0.0)));
    if (max(max(deviation.x, deviation.y), max(deviation.z, deviation.w)) > STEEP * depth_tolerance(own)) {
        aside = 0.5 * (vec2(right, upper) - f);
        return own;
    }
    if (uncovered > 0.0) aside = 0.5 * (vec2(weight.y + weight.z, weight.x + weight.y) / dot(weight, vec4(1.0)) - f);
#endif
    return dot(weight, depth) / dot(weight, vec4(1.0));
}
