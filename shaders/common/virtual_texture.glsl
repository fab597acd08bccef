// Looks texels of depth images up in a virtual texture, by texture coordinates of an image and a level of detail. The texels
// that may be needed are stored in one texture, the pages; `page_table` holds their places. A tile is 2 × 2 sub-tiles of
// SUB_TILE × SUB_TILE texels. A mip tier holds MIP_TIER_LEVELS = log2 SUB_TILE levels of detail; the next has a quarter of its
// side. COLOURED: colours differ from texel to texel. TINTED: by more than the principal components that each texel has of its
// own, which are one or, with PAIRED, two. PARTIAL: texels of the finest tier are left out. COORDINATES: the object has a
// texture, and pages may lack the first levels of their colours. TELLS_ROUGHNESS: texels tell roughness and metalness.
// Twin: reference/virtual_texture.py.
#from depthwalk.cook.used_texels import SUB_TILE
#include "common/depth_object.glsl"
#from depthwalk.cook.virtual_texture import LEVELS as MIP_TIER_LEVELS
uniform sampler2D page_normals;         // (object normal + 1) / 2, remainder of the depth
uniform sampler2D page_colours;         // components of colours, see colour_axes; with TINTED only the first ones,
uniform sampler2D page_tints;           // the others, at half the resolution
uniform isampler2DArray page_table;     // per tile: the offset of its texels in the pages, and which sub-tiles are stored
#ifdef TELLS_ROUGHNESS
uniform sampler2D page_reflections;     // roughness, metalness
#endif
#ifdef PARTIAL
#define page_detail stored_detail
#else
const int page_detail = 0;              // all is stored
#endif
#ifdef COORDINATES
#define colour_level stored_colour_level
#else
const int colour_level = 0;
#endif
#define tint_level max(colour_level, 1)

// Converts texels of an image to those of one of its mip tiers, counted from half a sub-tile before it. From one tier to the
// next this is t' = t / SUB_TILE + SUB_TILE / 2, which has a fixed point, FIXED.
vec2 texel_in_tier(vec2 texel, int tier) {
    const float FIXED = float(SUB_TILE * SUB_TILE) / float(2 * (SUB_TILE - 1));
    return (texel + float(SUB_TILE / 2) - FIXED) * exp2(-float(MIP_TIER_LEVELS * tier)) + FIXED;
}

// Whether a mip tier of an image is stored around a texel of the image; if so, `place` is its place, in texels of the pages.
bool in_pages(int image, vec2 texel, int tier, out vec2 place) {
    place = texel_in_tier(texel, tier);
    ivec2 sub_tile = ivec2((place - float(SUB_TILE / 2)) / float(SUB_TILE));
    ivec2 entry = texelFetch(page_table, ivec3(sub_tile / 2 + ivec2(0, first_rows[tier]), image), 0).xy;
    place += vec2(entry & ivec2(~(SUB_TILE - 1)));
    if (tier == 0 && page_detail > 0) place *= 0.5;
    int row = (sub_tile.y & 1) == 0 ? entry.x : entry.y;
    return (row >> (sub_tile.x & 1) & 1) != 0;
}

// Returns the place at which a point of an image is stored, in the finest mip tier that is stored and that `lod` asks for. xy:
// texels of the pages; z: the level of detail within the tier. uv: within the image; tier: the one found.
vec3 page_at(int image, vec2 uv, float lod, out int tier) {
    vec2 texel = clamp(uv * image_size, vec2(0.0), image_size - 0.01);
    // Lanes that draw nothing may have any lod, but must end the loop.
    tier = clamp(int(lod / float(MIP_TIER_LEVELS)), page_detail / 2, last_mip_tier);
    vec2 place;
    while (!in_pages(image, texel, tier, place) && tier < last_mip_tier) ++tier;
    if (tier == 0) lod -= float(page_detail);
    return vec3(place, clamp(lod - float(MIP_TIER_LEVELS * tier), 0.0, float(MIP_TIER_LEVELS)));
}

// Whether the finest mip tier of an image is stored around uv; if so, `place` is its place. Only without PARTIAL.
bool page_stored(int image, vec2 uv, out vec2 place) {
    return in_pages(image, clamp(uv * image_size, vec2(0.0), image_size - 0.01), 0, place);
}

// The texel at a place that `page_at` returned, trilinear.
vec4 page_texel(sampler2D picture, vec3 place) {
    return textureLod(picture, place.xy / vec2(textureSize(picture, 0)), place.z);
}

// The same place in a picture whose first level is a mip level of the pages.
vec3 at_level(vec3 place, int level) { return vec3(place.xy * exp2(-float(level)), max(place.z - float(level), 0.0)); }

// All three components of a colour, from the texel's own ones and those that it shares with its neighbours.
vec3 colour_components(vec2 own, vec2 tints) {
#ifdef PAIRED
    return vec3(own, tints.r);
#else
    return vec3(own.r, tints);
#endif
}

vec4 page_colour(vec3 place) {
#if defined TINTED
    vec2 own = page_texel(page_colours, at_level(place, colour_level)).rg;
    vec2 tints = page_texel(page_tints, at_level(place, tint_level)).rg;
    return first_colour + colour_axes * colour_components(own, tints);
#elif defined COLOURED
    return page_texel(page_colours, at_level(place, colour_level));
#else
    return first_colour;
#endif
}

// Four texels of level 0 around a place, at (0,0) (1,0) (0,1) (1,1), and their weights, which sum to 1.
struct Around {
    ivec2 at[4];
    vec4 weight;
};

// For bilinear filtering.
Around texels_around(vec2 place) {
    ivec2 low = ivec2(floor(place - 0.5));
    vec2 f = place - 0.5 - vec2(low), g = 1.0 - f;
    ivec2 at[4] = ivec2[4](low, low + ivec2(1, 0), low + ivec2(0, 1), low + ivec2(1, 1));
    return Around(at, vec4(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y));
}

// The colour between four texels.
vec4 page_colour(Around around) {
#ifdef COLOURED
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; ++k) {
        vec4 texel = texelFetch(page_colours, around.at[k] >> colour_level, 0);
#ifdef TINTED
        texel.rgb = colour_components(texel.rg, texelFetch(page_tints, around.at[k] >> tint_level, 0).rg);
#endif
        sum += around.weight[k] * texel;
    }
#ifdef TINTED
    sum = first_colour + colour_axes * sum.rgb;
#endif
    return sum;
#else
    return first_colour;
#endif
}

#ifdef TELLS_ROUGHNESS
// Roughness and metalness between four texels.
vec2 page_reflection(Around around) {
    vec2 sum = vec2(0.0);
    for (int k = 0; k < 4; ++k) sum += around.weight[k] * texelFetch(page_reflections, around.at[k], 0).rg;
    return sum;
}
#endif

// The normal, not of length 1, at a place of level 0, by the cubics of Catmull and Rom 1974 through the texels. Under
// magnification it keeps ridges that bilinear filtering blurs. around: the texels of that filter, at (0,0) (1,0) (0,1) (1,1).
vec3 page_normal(vec2 place, out vec4 around[4]) {
    vec2 low = floor(place - 0.5), f = place - 0.5 - low, g = 1.0 - f;
    vec4 across = 0.5 * vec4(-f.x * g.x * g.x, g.x * (2.0 + 2.0 * f.x - 3.0 * f.x * f.x),
                             f.x * (2.0 + 2.0 * g.x - 3.0 * g.x * g.x), -g.x * f.x * f.x);
    vec4 up = 0.5 * vec4(-f.y * g.y * g.y, g.y * (2.0 + 2.0 * f.y - 3.0 * f.y * f.y),
                         f.y * (2.0 + 2.0 * g.y - 3.0 * g.y * g.y), -g.y * f.y * f.y);
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 16; ++k) {
        ivec2 at = ivec2(k & 3, k >> 2);
        vec4 texel = texelFetch(page_normals, ivec2(low) + at - 1, 0);
        sum += across[at.x] * up[at.y] * texel.xyz;
        ivec2 near = at - 1;
        if (near == (near & 1)) around[near.x + 2 * near.y] = texel;
    }
    return sum * 2.0 - 1.0;
}
