// Decides how each tile of the screen is drawn (`TileClass`). Twin: reference/reprojection.py.
//
// The pixels of a tile show places of the picture between those of the nearest surface that may have moved there and those at
// which the search ended. If the picture is plane enough in all of that area, places are interpolated instead of searched.
#from depthwalk.render.reprojection.smooth_tiles import MOST_CELLS, ROUGHNESS_CELL, TILE, TileClass as CLASS
#from depthwalk.render.reprojection.smooth_tiles import MOVES, TOLERANCE
#from depthwalk.render.reprojection.reprojection import BEYOND
#include "reprojection/search.glsl"
uniform sampler2D places;       // of places.frag
uniform sampler2D roughness;    // of roughness.frag
uniform vec2 pixel;             // of the screen, as a part of it
uniform float focal_pixels;     // of the screen

layout(location = 0) out float tile_class;

vec3 found_at(ivec2 tile, int x, int y) { return texelFetch(places, 2 * tile + ivec2(x, y), 0).xyz; }

void main() {
    ivec2 tile = ivec2(gl_FragCoord.xy);
    vec2 size = vec2(textureSize(distances, 0));
    vec2 corners[4], low = vec2(1e9), high = vec2(-1e9);
    float distance = nearest_along((vec2(tile) + 0.5) * float(TILE) * pixel);
    for (int k = 0; k < 4; ++k) {
        corners[k] = found_at(tile, 2 * (k & 1), 2 * (k >> 1)).xy;
        vec2 near = place_of(viewer + distance * ray_at(vec2(tile + ivec2(k & 1, k >> 1)) * float(TILE) * pixel));
        low = min(low, near);
        high = max(high, near);
    }
    vec2 seen_low = corners[0], seen_high = corners[0];
    float off = 0.0, all_seen = 1.0;
    for (int k = 0; k < 9; ++k) {
        ivec2 at = ivec2(k % 3, k / 3);
        vec3 found = found_at(tile, at.x, at.y);
        vec2 between = mix(mix(corners[0], corners[1], 0.5 * float(at.x)), mix(corners[2], corners[3], 0.5 * float(at.x)),
                           0.5 * float(at.y));
        off = max(off, length((found.xy - between) * size));
        all_seen = min(all_seen, found.z);
        seen_low = min(seen_low, found.xy);
        seen_high = max(seen_high, found.xy);
    }
    low = clamp(min(low, seen_low), 0.0, 1.0);
    high = clamp(max(high, seen_high), 0.0, 1.0);
    ivec2 first = ivec2(low * size) / ROUGHNESS_CELL, last = min(ivec2(high * size), ivec2(size) - 1) / ROUGHNESS_CELL;
    // Pixels of the screen by which a surface moves for each 1/m of its inverse distance.
    vec2 tangents = (seen_low + seen_high - 1.0) * half_extent;
    float parallax = focal_pixels * length(tangents * viewer.z - viewer.xy), most = 0.0;
    bool is_small = all(lessThan(last - first, ivec2(MOST_CELLS)));
    if (is_small)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x) most = max(most, texelFetch(roughness, ivec2(x, y), 0).r);
    bool is_within = all(greaterThanEqual(seen_low, vec2(0.0))) && all(lessThanEqual(seen_high, vec2(1.0)));
    bool is_smooth = is_small && all_seen > 0.0 && off < TOLERANCE && most * parallax < TOLERANCE;
    bool may_move = false;
#ifdef MOVED
    float came = texture(nearest_moved, (vec2(tile) + 0.5) * float(TILE) * pixel * cells_shown).r;
    may_move = came < BEYOND || most >= MOVES || !is_small;
#endif
    tile_class = float(!is_within ? CLASS_AROUND : may_move ? CLASS_MOVED : is_smooth ? CLASS_SMOOTH
                       : all_seen < 1.0 ? CLASS_UNCOVERED : CLASS_SEARCHED);
}
