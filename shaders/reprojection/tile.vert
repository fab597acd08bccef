// Covers the tiles of one class with a point each, and passes on the places of its corners in the picture.
#from depthwalk.render.reprojection.smooth_tiles import TILE
uniform sampler2D class_texture;    // of classes.frag
uniform sampler2D places;           // of places.frag
uniform int drawn_class;            // the class to draw

flat out vec2 corner, across, up, twist; // place of its lower left corner; change per pixel to the right, up, and both

void main() {
    ivec2 tiles = textureSize(class_texture, 0), tile = ivec2(gl_VertexID % tiles.x, gl_VertexID / tiles.x);
    bool is_drawn = int(texelFetch(class_texture, tile, 0).r) == drawn_class;
    corner = texelFetch(places, 2 * tile, 0).xy;
    across = (texelFetch(places, 2 * tile + ivec2(2, 0), 0).xy - corner) / float(TILE);
    up = (texelFetch(places, 2 * tile + ivec2(0, 2), 0).xy - corner) / float(TILE);
    twist = ((texelFetch(places, 2 * tile + 2, 0).xy - corner) / float(TILE) - across - up) / float(TILE);
    gl_PointSize = float(TILE);
    gl_Position = is_drawn ? vec4((vec2(tile) + 0.5) / vec2(tiles) * 2.0 - 1.0, 0.0, 1.0) : vec4(-2.0, -2.0, 0.0, 1.0);
}
