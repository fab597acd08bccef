// Looks texels of depth images up in a virtual texture, by texture coordinates of an image and a level of detail: tiles that
// are stored lie in one picture, `page_table` tells where. A block is 2 × 2 grains of SUB_TILE × SUB_TILE texels; a segment serves
// MIP_TIER_LEVELS levels of detail, each segment being a quarter, either way, of the one before (MIP_TIER_LEVELS = log2 SUB_TILE).
// COLOURED: their colours differ; TINTED: in what one component tells, and little else.
#from depthwalk.cook.used_texels import SUB_TILE
#from depthwalk.cook.virtual_texture import LEVELS as MIP_TIER_LEVELS, MAX_MIP_TIERS
uniform sampler2D page_normals;         // (object normal + 1) / 2, remainder of the depth
uniform sampler2D page_colours;         // components of colours, see colour_axes; with TINTED only the first,
uniform sampler2D page_tints;           // the next two, at half the resolution
uniform vec4 first_colour;              // √linear colour, specular strength; all there is where all are alike
uniform mat3x4 colour_axes;             // what each component adds
uniform isampler2DArray page_table;     // per block: what takes a texel to its place + which of its grains are stored
uniform vec2 image_size;                // texels
uniform int first_rows[MAX_MIP_TIERS];   // of each segment's blocks in the table
uniform int last_mip_tier;

// Texels of an image as those of its segment `segment`, from half a grain before it on: each quarter begins so in the one
// before, t' = t / SUB_TILE + SUB_TILE / 2, which leaves one texel where it is.
vec2 in_segment(vec2 texel, int segment) {
    const float FIXED = float(SUB_TILE * SUB_TILE) / float(2 * (SUB_TILE - 1));
    return (texel + float(SUB_TILE / 2) - FIXED) * exp2(-float(MIP_TIER_LEVELS * segment)) + FIXED;
}

// Whether a segment of an image is stored around a texel of the image; if so, its place there, texels of the pages.
bool in_pages(int image, vec2 texel, int segment, out vec2 place) {
    place = in_segment(texel, segment);
    ivec2 grain = ivec2((place - float(SUB_TILE / 2)) / float(SUB_TILE));
    ivec2 entry = texelFetch(page_table, ivec3(grain / 2 + ivec2(0, first_rows[segment]), image), 0).xy;
    place += vec2(entry & ivec2(~(SUB_TILE - 1)));
    int row = (grain.y & 1) == 0 ? entry.x : entry.y;
    return (row >> (grain.x & 1) & 1) != 0;
}

// The place of a point of an image: xy, texels of the pages; z, the level of detail there. uv: within the image.
vec3 page_at(int image, vec2 uv, float lod) {
    vec2 texel = clamp(uv * image_size, vec2(0.0), image_size - 0.01);
    // Lanes that draw nothing have any lod, and walk as far.
    int segment = clamp(int(lod / float(MIP_TIER_LEVELS)), 0, last_mip_tier);
    vec2 place;
    while (!in_pages(image, texel, segment, place) && segment < last_mip_tier) ++segment;
    return vec3(place, clamp(lod - float(MIP_TIER_LEVELS * segment), 0.0, float(MIP_TIER_LEVELS)));
}

// Whether an image is stored around uv, itself and not its quarter; if so, its place there.
bool page_stored(int image, vec2 uv, out vec2 place) {
    return in_pages(image, clamp(uv * image_size, vec2(0.0), image_size - 0.01), 0, place);
}

// What `page_at` found at a place, trilinear.
vec4 page_texel(sampler2D picture, vec3 place) {
    return textureLod(picture, place.xy / vec2(textureSize(picture, 0)), place.z);
}
vec4 page_colour(vec3 place) {
#if defined TINTED
    vec3 tint = vec3(place.xy / 2.0, max(place.z - 1.0, 0.0));
    float first = page_texel(page_colours, place).r;
    return first_colour + colour_axes * vec3(first, page_texel(page_tints, tint).rg);
#elif defined COLOURED
    return page_texel(page_colours, place);
#else
    return first_colour;
#endif
}

// Between four texels, in such parts, which sum up to 1.
vec4 page_colour(ivec2 at[4], vec4 part) {
#ifdef COLOURED
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; ++k) {
        vec4 texel = texelFetch(page_colours, at[k], 0);
#ifdef TINTED
        texel.gb = texelFetch(page_tints, at[k] / 2, 0).rg;
#endif
        sum += part[k] * texel;
    }
#ifdef TINTED
    sum = first_colour + colour_axes * sum.rgb;
#endif
    return sum;
#else
    return first_colour;
#endif
}

// The normal, not of length 1, at a place of level 0, by the cubics of Catmull and Rom 1974 through the texels: magnified, it
// keeps ridges that a blend of two texels blurs. around: the texels that a blend would take, at (0,0) (1,0) (0,1) (1,1).
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
