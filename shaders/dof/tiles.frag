// Finds the least and the greatest circle of confusion, in pixels, of each tile of the picture (McGuire et al. 2012).
uniform sampler2D circles_texture;  // of `reduce`
uniform int tile_side;              // of its pixels
layout(location = 0) out vec2 range;

void main() {
    ivec2 low = ivec2(gl_FragCoord.xy) * tile_side;
    ivec2 high = min(low + tile_side, textureSize(circles_texture, 0));
    range = vec2(1e4, -1e4);
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) {
            vec2 block = texelFetch(circles_texture, ivec2(x, y), 0).yz;
            range = vec2(min(range.x, block.x), max(range.y, block.y));
        }
}
