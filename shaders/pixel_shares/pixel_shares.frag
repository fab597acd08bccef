// Copies the number of the front object at some pixels, spread evenly over the picture, which is quicker to read back than all.
#include "common/visibility.glsl"
#from depthwalk.render.pixel_shares import CAPTURED_VIEW, POLYGON
uniform usampler2D visibility_texture;
uniform sampler2D depth_texture;
uniform vec2 spacing;       // pixels from one sampled pixel to the next, along either axis

layout(location = 0) out uint number;   // of the object, counted from 1; POLYGON for meshes, CAPTURED_VIEW for captured views, 0 for ground and nothing

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy * spacing);
    uvec2 visibility = texelFetch(visibility_texture, pixel, 0).xy;
    number = object_of(visibility);
    if (number == 0u && visibility != GROUND) number = uint(is_captured(visibility) ? CAPTURED_VIEW : POLYGON);
    if (texelFetch(depth_texture, pixel, 0).r == 1.0) number = 0u;
}
