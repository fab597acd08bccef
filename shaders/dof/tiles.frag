// Finds the least and the greatest circle of confusion, in pixels, of each tile of the picture (McGuire et al. 2012).
#include "dof/circle.glsl"
uniform int tile_side;      // pixels
layout(location = 0) out vec2 range;

void main() {
    ivec2 low = ivec2(gl_FragCoord.xy) * tile_side;
    ivec2 high = min(low + tile_side, textureSize(depth_texture, 0));
    range = vec2(largest, -largest);
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) {
            float radius = circle_at(ivec2(x, y));
            range = vec2(min(range.x, radius), max(range.y, radius));
        }
}
