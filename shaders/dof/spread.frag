// Finds the least and the greatest circle of confusion, in pixels, that may reach into each tile: its own, and of the tiles
// around those that are larger than the gap between (McGuire et al. 2012, with the gap in place of the next neighbours).
// Beside them those of all tiles that the tile's own circles reach, or that reach it.
uniform sampler2D tile_texture;
uniform int tile_side;      // pixels
uniform float largest;      // radius, pixels
layout(location = 0) out vec4 range;

void main() {
    ivec2 tile = ivec2(gl_FragCoord.xy), last = textureSize(tile_texture, 0) - 1;
    int around = int(ceil(largest / float(tile_side)));
    ivec2 low = max(tile - around, ivec2(0)), high = min(tile + around, last);
    vec2 own = texelFetch(tile_texture, tile, 0).xy;
    float reach = max(-own.x, own.y);
    range = own.xyxy;
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
            vec2 other = texelFetch(tile_texture, ivec2(x, y), 0).xy;
            vec2 apart = vec2(max(abs(ivec2(x, y) - tile) - 1, ivec2(0)) * tile_side);
            float gap = length(apart);
            if (-other.x > gap) range.x = min(range.x, other.x);
            if (other.y > gap) range.y = max(range.y, other.y);
            if (max(reach, max(-other.x, other.y)) > gap) range.zw = vec2(min(range.z, other.x), max(range.w, other.y));
        }
}
