// Fetches records of the objects that are visible, by their numbers.
#from depthwalk.render.draw.material_depth import SURFACE_RECORD
#include "common/records.glsl"
#include "common/visibility.glsl"
uniform usampler2D visibility_texture;
uniform sampler2D objects;

// part: which of the record's texels.
vec4 object_texel(uint object, int part) { return record_part(objects, SURFACE_RECORD_TEXELS, int(object), part); }
