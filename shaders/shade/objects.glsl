// Fetches records of the objects that are visible, by their numbers.
#from depthwalk.gpu.instances import RECORDS_PER_ROW
#from depthwalk.render.draw.material_depth import SURFACE_RECORD
#include "common/visible.glsl"
uniform usampler2D visibility_texture;
uniform sampler2D objects;

// part: which of the record's texels.
vec4 object_texel(uint object, int part) {
    uint column = object % uint(RECORDS_PER_ROW), row = object / uint(RECORDS_PER_ROW);
    return texelFetch(objects, ivec2(column * uint(SURFACE_RECORD_TEXELS) + uint(part), row), 0);
}
