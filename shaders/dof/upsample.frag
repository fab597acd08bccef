// Magnifies the result of a reduced picture, where all circles of confusion are wide.
#include "common/dither.glsl"
uniform sampler2D gathered_texture;   // of `reduced`, linear filter
uniform float block;                // pixels along one of its pixels
layout(location = 0) out vec4 lit;

void main() {
    vec2 size = block * vec2(textureSize(gathered_texture, 0));
    lit = textureLod(gathered_texture, gl_FragCoord.xy / size, 0.0);
    lit.rgb = dithered(lit.rgb);    // passed on already, but for this
}
