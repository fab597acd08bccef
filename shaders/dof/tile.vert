// Covers the tiles of given classes with a point each, which is a square. With two triangles a software rasteriser would compute
// the blocks along the diagonal twice, and with a branch in the shader both of its sides.
uniform sampler2D class_texture;    // of `classes`
uniform int tile_side;              // pixels of the target, whose viewport has whole tiles
uniform int drawn_class;            // the classes to draw
uniform int beside_class;           // and those beside which to draw all but `left_out`
uniform int left_out;

void main() {
    ivec2 tiles = textureSize(class_texture, 0), tile = ivec2(gl_VertexID % tiles.x, gl_VertexID / tiles.x);
    ivec2 classes = ivec2(texelFetch(class_texture, tile, 0).xy);
    bool drawn = (classes.x & drawn_class) != 0 || ((classes.y & beside_class) != 0 && (classes.x & left_out) == 0);
    vec2 middle = (vec2(tile) + 0.5) / vec2(tiles);
    gl_PointSize = float(tile_side);
    gl_Position = drawn ? vec4(middle * 2.0 - 1.0, 0.0, 1.0) : vec4(-2.0, -2.0, 0.0, 1.0);
}
