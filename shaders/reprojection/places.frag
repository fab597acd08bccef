// Finds the places of a finished picture that appear at the corners of the screen's tiles and at the points midway between.
// Twin: reference/reprojection.py.
#from depthwalk.render.reprojection.smooth_tiles import TILE
#include "reprojection/search.glsl"
uniform vec2 pixel;     // of the screen, as a part of it

layout(location = 0) out vec4 found_place;  // x, y; z: 0 where the surface to show is hidden in the picture, 1 where any search finds it, else ½

void main() {
    vec2 uv = floor(gl_FragCoord.xy) * (0.5 * float(TILE)) * pixel;
    vec3 ray = ray_at(uv);
    float start = nearest_along(uv);
    Found found = search(ray, start, vec4(0.0), true), passing = search(ray, start, vec4(0.0), false);
    bool hidden = is_hidden(found), is_sure = !is_lost(found) && abs(passing.along - found.along) < (1.0 - HIDDEN) * found.along;
    found_place = vec4(hidden ? found.behind : found.place, hidden ? 0.0 : is_sure ? 1.0 : 0.5, 0.0);
}
