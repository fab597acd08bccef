// Copies a finished shadow map to its tile.
uniform sampler2D map_texture;
uniform ivec2 corner;       // lower left one of the tile, texels

void main() {
    gl_FragDepth = texelFetch(map_texture, ivec2(gl_FragCoord.xy) - corner, 0).r;
}
