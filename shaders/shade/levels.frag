// The asset that is visible at each pixel, as a depth: a test for EQUAL then picks the pixels of one asset. Where nothing is
// drawn the number is 0, as of polygons.
#include "shade/objects.glsl"
uniform float closed;       // what is added to the depths of pixels that one object covers whole

in vec2 uv;

void main() {
    uvec2 visible = texture(visible_texture, uv).xy;
    gl_FragDepth = object_texel(object_of(visible), LEVEL).x - (open_of(visible) > 0.0 ? closed : 0.0);
}
