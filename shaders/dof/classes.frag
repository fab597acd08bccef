// Classifies how each tile is gathered, by the circles of confusion in and around it (`TileClass`). Writes its class, and the
// bits of the classes around it, since filters read across a tile's border. Twin: reference/dof_tiles.py.
#from depthwalk.render.view.lens import LEAST_HALF, LEAST_QUARTER, EVEN, LEAST_STEP, SHARP_RADIUS, TileClass as TILE
uniform sampler2D range_texture;    // of `spread`
layout(location = 0) out vec4 classes;

int class_of(ivec2 tile) {
    vec4 range = texelFetch(range_texture, tile, 0);
    if (max(-range.x, range.y) < SHARP_RADIUS) return TILE_SHARP;
    bool even = range.w <= max(LEAST_STEP, EVEN * range.z);
    if (range.z >= LEAST_QUARTER) return even ? TILE_QUARTER_EVEN : TILE_QUARTER;
    if (range.z >= LEAST_HALF) return even ? TILE_HALF_EVEN : TILE_HALF;
    return even ? TILE_EVEN : TILE_MIXED;
}

void main() {
    ivec2 tile = ivec2(gl_FragCoord.xy), last = textureSize(range_texture, 0) - 1;
    int beside = 0;
    for (int k = 0; k < 9; ++k)
        beside |= class_of(clamp(tile + ivec2(k % 3, k / 3) - 1, ivec2(0), last));
    classes = vec4(float(class_of(tile)), float(beside), 0.0, 0.0);
}
