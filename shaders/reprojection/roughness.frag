// Measures how far from plane each cell of a finished picture is: the largest deviation of an inverse distance in it from the
// plane through those at its corners, 1/m. A plane of the scene has inverse distances that are linear in the picture. Twin:
// reference/finished_picture.py.
//
// MOVED: `MOVES` where anything moves by itself in the cell of `CELL` pixels around it.
#from depthwalk.render.reprojection.nearest_cells import CELL
#from depthwalk.render.reprojection.reprojection import BEYOND
#from depthwalk.render.reprojection.smooth_tiles import MOVES, ROUGHNESS_CELL
uniform sampler2D distances;
uniform sampler2D moving;   // with MOVED, of moving_nearest.frag

layout(location = 0) out float roughness;

float inverse_at(ivec2 texel) {
    return 1.0 / abs(texelFetch(distances, min(texel, textureSize(distances, 0) - 1), 0).r);
}

void main() {
    // A cell includes the edges of its neighbours, so that a step between two is found.
    ivec2 first = ivec2(gl_FragCoord.xy) * ROUGHNESS_CELL, beyond = ivec2(ROUGHNESS_CELL, 0);
    vec4 corners = vec4(inverse_at(first), inverse_at(first + beyond.xy), inverse_at(first + beyond.yx),
                        inverse_at(first + beyond.xx));
    vec2 slope = vec2(corners.y + corners.w - corners.x - corners.z, corners.z + corners.w - corners.x - corners.y) /
                 float(2 * ROUGHNESS_CELL);
    float middle = dot(corners, vec4(0.25)) - 0.5 * float(ROUGHNESS_CELL) * (slope.x + slope.y);
    roughness = 0.0;
    for (int y = 0; y <= ROUGHNESS_CELL; ++y)
        for (int x = 0; x <= ROUGHNESS_CELL; ++x)
            roughness = max(roughness, abs(inverse_at(first + ivec2(x, y)) - middle - dot(slope, vec2(x, y))));
#ifdef MOVED
    if (texelFetch(moving, first / CELL, 0).w < BEYOND) roughness = MOVES;
#endif
}
