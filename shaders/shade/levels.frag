// The asset that is visible at each pixel, as a depth: a test for EQUAL then picks the pixels of one asset.
#include "shade/objects.glsl"
uniform sampler2D depth_texture;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(depth_texture, pixel, 0).r == 1.0) discard;
    uint object = object_of(texelFetch(visible_texture, pixel, 0).xy);
    if (object == 0u) discard;
    gl_FragDepth = object_texel(object, LEVEL).x;
}
