// Finds the least and the greatest circle of confusion, in pixels, of each tile of the picture (McGuire et al. 2012), and the
// largest difference of circles within the width of two blocks. Twin: reference/dof_tiles.py.
uniform sampler2D circles_texture;  // of `reduce`
uniform int tile_side;              // of its pixels
layout(location = 0) out vec4 found;

void main() {
    ivec2 low = ivec2(gl_FragCoord.xy) * tile_side, last = textureSize(circles_texture, 0) - 1;
    ivec2 high = min(low + tile_side - 1, last);
    vec2 range = vec2(1e4, -1e4);
    float step = 0.0;
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
            vec2 block = texelFetch(circles_texture, ivec2(x, y), 0).yz;
            vec2 right = texelFetch(circles_texture, ivec2(min(x + 1, last.x), y), 0).yz;
            vec2 above = texelFetch(circles_texture, ivec2(x, min(y + 1, last.y)), 0).yz;
            range = vec2(min(range.x, block.x), max(range.y, block.y));
            step = max(step, max(block.y, max(right.y, above.y)) - min(block.x, min(right.x, above.x)));
        }
    found = vec4(range, step, 0.0);
}
