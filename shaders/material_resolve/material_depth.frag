// Writes the asset that is visible at each pixel as a depth, its material depth, so that a test for EQUAL picks the pixels of
// one asset. Pixels without a depth-image object have object number 0, whose record stands for none.
#from depthwalk.render.draw.material_depth import FULL_COVERAGE    // what full coverage adds to a depth
#include "material_resolve/objects.glsl"

in vec2 uv;

void main() {
    uvec2 visibility = texture(visibility_texture, uv).xy;
    gl_FragDepth = object_texel(object_of(visibility), SURFACE_RECORD_MATERIAL_DEPTH).x;
    if (uncovered_of(visibility) > 0.0) gl_FragDepth -= FULL_COVERAGE;   // before all that are fully covered
}
