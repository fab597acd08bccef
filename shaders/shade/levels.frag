// Writes the asset that is visible at each pixel as a depth, its material depth: a test for EQUAL then picks the pixels of one
// asset. Where nothing is drawn the number is 0, as of polygons.
#from depthwalk.render.draw.material_depth import FULL_COVERAGE    // what full coverage adds to a depth
#include "shade/objects.glsl"

in vec2 uv;

void main() {
    uvec2 visible = texture(visibility_texture, uv).xy;
    gl_FragDepth = object_texel(object_of(visible), SURFACE_RECORD_LEVEL).x;
    if (uncovered_of(visible) > 0.0) gl_FragDepth -= FULL_COVERAGE;
}
