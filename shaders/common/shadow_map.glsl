// Filters shadow maps, in texels of a tile: several maps share a texture, as tiles of equal size (percentage-closer
// filtering, Reeves, Salesin and Cook 1987). Twin: reference/shadows.py.
// FILTER_WIDTH: texels. The compiler knows it, as software rasterisers take a third of the time for loops that it unrolls.
uniform float error;            // error of shadow casters, texels
uniform float seen_error;       // error of surfaces in the picture, metres at one metre

// Returns how far a point is moved along its normal so that its surface does not shadow itself, texels. Over half the width of
// the filter a plane comes nearer to the light by that width times the tangent of its slope; along the normal, times the sine.
// Half a texel is added for places between texels. sine: of the angle between the normal and the axis of the map.
float lift(float sine) { return 0.5 * float(FILTER_WIDTH) * sine + 0.5 + error; }

// Returns how near to an edge of its tile a point may be, as a part of the width, before the filter reads the next tile.
float map_margin(int resolution) { return 0.5 * float(FILTER_WIDTH) / float(resolution); }

// Returns the mean over the square of FILTER_WIDTH texels about a point, its rim weighted as bilinear filters do.
// tile: column and row; at: 0 … 1 across the tile and in depth.
float filtered(sampler2DShadow maps, vec2 tile, int resolution, vec3 at) {
    vec2 size = vec2(textureSize(maps, 0));
    float first = 0.5 * float(FILTER_WIDTH) - 1.0;
    float sum = 0.0;
    for (int j = 0; j < FILTER_WIDTH - 1; ++j)
        for (int i = 0; i < FILTER_WIDTH - 1; ++i) {
            vec2 texels = (tile + at.xy) * float(resolution) + vec2(i, j) - first;
            sum += textureLod(maps, vec3(texels / size, at.z), 0.0);
        }
    return sum / float((FILTER_WIDTH - 1) * (FILTER_WIDTH - 1));
}
