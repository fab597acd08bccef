// Finds the least and the greatest circle of confusion, in pixels, that may reach into each tile: its own, and those of tiles
// around that are larger than the gap in between (McGuire et al. 2012, with the gap in place of the next neighbours). Also
// writes the least circle and the largest difference between neighbours in all tiles within reach.
// Twin: reference/dof_tiles.py.
uniform sampler2D tile_texture;
uniform int tile_side;      // pixels
uniform float largest;      // radius, pixels
layout(location = 0) out vec4 found;

void main() {
    ivec2 tile = ivec2(gl_FragCoord.xy), last = textureSize(tile_texture, 0) - 1;
    int around = int(ceil(largest / float(tile_side)));
    ivec2 low = max(tile - around, ivec2(0)), high = min(tile + around, last);
    vec2 range = texelFetch(tile_texture, tile, 0).xy, all = range;
    float reach = max(-range.x, range.y), step = 0.0;
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
            vec4 other = texelFetch(tile_texture, ivec2(x, y), 0);
            vec2 apart = vec2(max(abs(ivec2(x, y) - tile) - 1, ivec2(0)) * tile_side);
            float gap = length(apart);
            if (-other.x > gap) range.x = min(range.x, other.x);
            if (other.y > gap) range.y = max(range.y, other.y);
            if (max(reach, max(-other.x, other.y)) >= gap) {
                all = vec2(min(all.x, other.x), max(all.y, other.y));
                step = max(step, other.z);
            }
        }
    found = vec4(range, max(0.0, max(all.x, -all.y)), step);
}
