// Records of the objects that are visible, three texels each (render/records.py: SURFACE_RECORD).
#include "common/visible.glsl"
uniform usampler2D visible_texture;
uniform sampler2D objects;

const uint TEXELS = 3u, PER_ROW = 1024u;
const uint VIEWER = 0u, ROTATION = 1u, LEVEL = 2u;

vec4 object_texel(uint object, uint part) {
    return texelFetch(objects, ivec2(object % PER_ROW * TEXELS + part, object / PER_ROW), 0);
}
