// Declares what is read of a depth-image object: `DEPTH_OBJECT` in Python, a buffer for each. Lengths: metres, object frame.
#from depthwalk.bake.images import FACE_COUNT
#from depthwalk.cook.virtual_texture import MAX_MIP_TIERS
layout(std140) uniform DepthObject {
    vec4 cylinder;                      // radius, bottom, half width, half depth
    vec3 box_low;                       // the box that positions of samples are fractions of
    float setback;                      // of boundary strips, which extrapolate a surface, behind its samples
    vec3 box_size;
    float meso_spacing;                 // between the samples of the finest grid
    float cylinder_height;
    float shininess;
    vec2 image_size;                    // texels
    vec2 meso_tile;                     // width and height of a tile
    float meso_turn;                    // tiles around the side
    float meso_texels;                  // per metre
    float meso_height;                  // 0 where an object has no meso-structure
    int last_mip_tier;                  // the coarsest that is stored
    int stored_detail;                  // of the finest tier: 1 every second texel is stored, 2 none; see `Detail`
    int stored_colour_level;            // mip level of the pages that `page_colours` begins with
    vec4 reflection;                    // of objects that reflect the sky, the first three: see common/gbuffer.glsl
    vec4 first_colour;                  // √linear colour, specular strength; without COLOURED of all texels
    mat3x4 colour_axes;                 // what each component adds
    int first_images[FACE_COUNT];       // number of each face's first image
    float texels[FACE_COUNT];           // per metre, on each face
    int first_rows[MAX_MIP_TIERS];      // rows of the table at which the tiles of each mip tier begin
};
