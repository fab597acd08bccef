// Writes the distance ahead of the nearest surface in each cell of a finished picture, metres. Twin:
// reference/finished_picture.py.
#from depthwalk.render.reprojection.nearest_cells import CELL, STRIDE
uniform sampler2D distances;

layout(location = 0) out float nearest;

void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * CELL, last = textureSize(distances, 0) - 1;
    nearest = abs(texelFetch(distances, first, 0).r);
    for (int y = STRIDE / 2; y < CELL; y += STRIDE)
        for (int x = STRIDE / 2; x < CELL; x += STRIDE)
            nearest = min(nearest, abs(texelFetch(distances, min(first + ivec2(x, y), last), 0).r));
}
