// The asset that is visible at each pixel, as a depth: a test for EQUAL then picks the pixels of one asset. Where nothing is
// drawn the number is 0, as of polygons.
#include "shade/objects.glsl"

void main() {
    uint object = object_of(texelFetch(visible_texture, ivec2(gl_FragCoord.xy), 0).xy);
    gl_FragDepth = object_texel(object, LEVEL).x;
}
