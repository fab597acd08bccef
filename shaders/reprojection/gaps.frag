// Fills cells of the screen in which no cell of the picture appears, as between parts of a slanted surface that has come near,
// with the nearest surface beside them: a search that started infinitely far away would miss what lies there.
#from depthwalk.render.reprojection.reprojection import BEYOND, GAP
uniform sampler2D moved;        // of moved_cell.frag

layout(location = 0) out float nearest;

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy), last = textureSize(moved, 0) - 1;
    nearest = texelFetch(moved, cell, 0).r;
    if (nearest < BEYOND) return;
    for (int y = -GAP; y <= GAP; ++y)
        for (int x = -GAP; x <= GAP; ++x)
            nearest = min(nearest, texelFetch(moved, clamp(cell + ivec2(x, y), ivec2(0), last), 0).r);
}
