// Covers the tiles of some classes with a point each, which is a square: of two triangles a software rasteriser would compute
// the blocks along the diagonal twice, and what a shader leaves out by a branch as well.
#from depthwalk.render.view.lens import LEAST_HALF, LEAST_QUARTER, EVEN, LEAST_STEP, SHARP_RADIUS, TileClass as TILE
uniform sampler2D range_texture;    // of `spread`
uniform int tile_side;              // pixels of what is drawn into, whose viewport has whole tiles
uniform int drawn_class;            // the classes to draw
uniform int beside_class;           // and those beside which to draw all but `left_out`: filters look across a tile's border
uniform int left_out;

// How a tile is gathered, by the circles of confusion in and around it, pixels.
int class_of(ivec2 tile) {
    vec4 range = texelFetch(range_texture, tile, 0);
    if (max(-range.x, range.y) < SHARP_RADIUS) return TILE_SHARP;
    bool even = range.w <= max(LEAST_STEP, EVEN * range.z);
    if (range.z >= LEAST_QUARTER) return even ? TILE_QUARTER_EVEN : TILE_QUARTER;
    if (range.z >= LEAST_HALF) return even ? TILE_HALF_EVEN : TILE_HALF;
    return even ? TILE_EVEN : TILE_MIXED;
}

bool is_drawn(ivec2 tile, ivec2 last) {
    int own = class_of(tile), beside = 0;
    if ((own & drawn_class) != 0) return true;
    if (beside_class == 0 || (own & left_out) != 0) return false;
    for (int k = 0; k < 9; ++k)
        beside |= class_of(clamp(tile + ivec2(k % 3, k / 3) - 1, ivec2(0), last));
    return (beside & beside_class) != 0;
}

void main() {
    ivec2 tiles = textureSize(range_texture, 0), tile = ivec2(gl_VertexID % tiles.x, gl_VertexID / tiles.x);
    vec2 middle = (vec2(tile) + 0.5) / vec2(tiles);
    gl_PointSize = float(tile_side);
    gl_Position = is_drawn(tile, tiles - 1) ? vec4(middle * 2.0 - 1.0, 0.0, 1.0) : vec4(-2.0, -2.0, 0.0, 1.0);
}
