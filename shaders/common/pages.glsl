// Where the texels of depth images lie that are stored, see render/pages.py.
uniform sampler2DArray pages;           // (object normal + 1) / 2, depth over reach; √linear colour, specular strength
uniform bool coloured;                  // whether there is the latter; else all is of the
uniform vec4 plain_colour;
uniform isampler2DArray page_table;     // per block: what takes a texel to its place + segment to look in
uniform vec2 image_size;                // texels
uniform int first_rows[5];              // of each segment's blocks in the table
uniform int last_segment;

const int NORMALS = 0, COLOURS = 1;     // pictures
const float BLOCK = 8.0;                // texels
const float LEVELS = 3.0;               // that a segment serves: each is an eighth of the one before

// Texels of an image as those of its segment `segment`, from half a block before it on: each eighth begins so in the one
// before, t' = t / 8 + 4.
vec2 in_segment(vec2 texel, int segment) {
    const float FIXED = 32.0 / 7.0;
    return (texel + BLOCK / 2.0 - FIXED) * exp2(-LEVELS * float(segment)) + FIXED;
}

// The place of a point of an image: xy, texels of the pages; z, the level of detail there. uv: within the image.
vec3 page_at(int image, vec2 uv, float lod) {
    vec2 texel = clamp(uv * image_size, vec2(0.0), image_size - 0.01);
    int segment = min(int(lod / LEVELS), last_segment);
    ivec2 block = ivec2((in_segment(texel, segment) - BLOCK / 2.0) / BLOCK);
    ivec2 entry = texelFetch(page_table, ivec3(block + ivec2(0, first_rows[segment]), image), 0).xy;
    segment = entry.x & 7;
    float level = clamp(lod - LEVELS * float(segment), 0.0, LEVELS);
    return vec3(in_segment(texel, segment) + vec2(entry & ivec2(~7)), level);
}

// Whether an image is stored around uv, itself and not its eighth.
bool page_stored(int image, vec2 uv) {
    ivec2 block = ivec2(clamp(uv * image_size, vec2(0.0), image_size - 0.01) / BLOCK);
    return (texelFetch(page_table, ivec3(block, image), 0).x & 7) == 0;
}

// One texel of a picture, and what `page_at` found there, trilinear.
vec4 page_fetch(ivec2 at, int picture) {
    if (picture == COLOURS && !coloured) return plain_colour;
    return texelFetch(pages, ivec3(at, picture), 0);
}
vec4 page_texel(vec3 place, int picture) {
    if (picture == COLOURS && !coloured) return plain_colour;
    vec2 size = vec2(textureSize(pages, 0).xy);
    return textureLod(pages, vec3(place.xy / size, float(picture)), place.z);
}
