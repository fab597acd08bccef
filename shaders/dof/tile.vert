// Covers the tiles of one class with a rectangle each; what is drawn elsewhere, software rasterisers would compute and discard.
#from depthwalk.render.view.lens import LEAST_COARSE, LEAST_PREFILTERED, EVEN, LEAST_STEP, SHARP_RADIUS, TileClass as TILE
uniform sampler2D range_texture;    // of `spread`
uniform vec2 tiles_across;          // tiles along the picture's width and height, the last ones cut off
uniform int tile_class;

// How the circles of confusion in and around a tile, pixels, ask for its picture to be gathered.
int class_of(vec4 range) {
    if (max(-range.x, range.y) < SHARP_RADIUS) return TILE_SHARP;
    bool even = range.w <= max(LEAST_STEP, EVEN * range.z), wide = range.z >= LEAST_COARSE;
    return wide ? (even ? TILE_WIDE_EVEN : TILE_WIDE) : (even ? (range.z >= LEAST_PREFILTERED ? TILE_PREFILTERED : TILE_EVEN) : TILE_MIXED);
}

void main() {
    ivec2 tiles = textureSize(range_texture, 0), tile = ivec2(gl_InstanceID % tiles.x, gl_InstanceID / tiles.x);
    bool drawn = (class_of(texelFetch(range_texture, tile, 0)) & tile_class) != 0;
    vec2 corner = vec2(tile + ivec2(gl_VertexID & 1, gl_VertexID >> 1)) / tiles_across;
    gl_Position = drawn ? vec4(corner * 2.0 - 1.0, 0.0, 1.0) : vec4(-2.0, -2.0, 0.0, 1.0);
}
