// Filters shadow maps, in texels of a tile: several maps share a texture, as tiles of equal size (percentage-closer
// filtering, Reeves, Salesin and Cook 1987). Twin: reference/shadows.py.
uniform int filter_width;       // texels
uniform float error;            // texels by which what casts shadows may be off
uniform float seen_error;       // metres at one metre by which what the picture shows may be off

// Over half the filter's width a plane comes nearer to the light by that times the tangent of its slope. Moved by so much
// times the sine along its normal, it does not shadow itself. Half a texel more is for what lies between texels. In texels;
// sine: of the angle between the normal and the map's axis.
float lift(float sine) { return 0.5 * float(filter_width) * sine + 0.5 + error; }

// Nearer to a tile's edges the filter would read others: part of its width.
float map_margin(int resolution) { return 0.5 * float(filter_width) / float(resolution); }

// Returns the mean over the square of `filter_width` texels about a point, its rim weighted as bilinear filters do. tile: column and
// row; at: 0 … 1 across the tile and in depth.
float filtered(sampler2DShadow maps, vec2 tile, int resolution, vec3 at) {
    vec2 size = vec2(textureSize(maps, 0));
    float first = 0.5 * float(filter_width) - 1.0;
    float sum = 0.0;
    for (int j = 0; j < filter_width - 1; ++j)
        for (int i = 0; i < filter_width - 1; ++i) {
            vec2 texels = (tile + at.xy) * float(resolution) + vec2(i, j) - first;
            sum += textureLod(maps, vec3(texels / size, at.z), 0.0);
        }
    return sum / float((filter_width - 1) * (filter_width - 1));
}
