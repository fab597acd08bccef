// Shows a finished picture as it appears to a camera that has moved since. Twin: reference/reprojection.py.
//
// EXACT: the camera is that of the picture; TURNED: it stands where that stood. AROUND: what lies beyond the picture's edges is
// what earlier pictures saw there. DISTANCE: how far ahead the surface is that one place of the screen shows, not its colour.
#from depthwalk.render.reprojection import BEYOND, REFLECTED
#include "reprojection/search.glsl"
#ifdef AROUND
#include "reprojection/surround.glsl"
uniform mat3 world_from_screen; // takes (x, y, 1), −1 to 1, to the ray of the new camera, world
#endif
uniform sampler2D picture;      // sRGB
uniform vec2 pixel;             // of the screen, as a part of it
uniform ivec2 margin;           // pixels that the picture has beyond the screen's on each side, of EXACT

#ifdef DISTANCE
uniform vec2 place_asked; // 0 to 1 over the screen, to the right and up
layout(location = 0) out float distance_shown; // metres along the new camera's axis; BEYOND where nothing is
#define uv place_asked
#else
layout(location = 0) out vec4 screen;
#define uv (gl_FragCoord.xy * pixel)
#endif

// Beyond its edges, where no earlier picture has seen anything either, a picture goes on as the mirror image of what lies along
// them, to and fro: more of the same, and no sky where ground must be.
vec2 mirrored(vec2 place) {
    vec2 inside = clamp(place, 0.0, 1.0);
    vec2 beyond = mod(abs(place - inside), 2.0 * REFLECTED);
    return abs(inside - min(beyond, 2.0 * REFLECTED - beyond));
}

// Returns the colour that the picture, or what was seen around it, has at a place. alone: not blended with its neighbours.
vec4 colour_at(vec2 place, bool alone) {
#ifdef AROUND
    if (place != clamp(place, 0.0, 1.0)) {
        vec4 seen = around(normalize(world_from_screen * vec3(2.0 * uv - 1.0, 1.0)));
        if (seen.a > 0.0) return seen;
    }
#endif
    vec2 inside = mirrored(place), size = vec2(textureSize(distances, 0));
    return texture(picture, alone ? (floor(inside * size) + 0.5) / size : inside);
}

void main() {
#if defined EXACT
    screen = texelFetch(picture, ivec2(gl_FragCoord.xy) + margin, 0);
#elif defined TURNED
    screen = colour_at(place_of(ray_at(uv)), false);
#else
    vec3 ray = ray_at(uv);
    Found found = search(ray, nearest_place(uv, ray));
    bool hidden = is_hidden(found);
#ifdef DISTANCE
    vec2 place = mirrored(hidden ? found.behind : found.place);
    float ahead = abs(texture(distances, place).r);
    distance_shown = ahead < BEYOND ? dot(axis, vec3((2.0 * place - 1.0) * half_extent, 1.0) * ahead - viewer) : BEYOND;
#else
    // Beside what is nearer a pixel keeps to itself: in the blend of four it would take the edge of that with it.
    screen = colour_at(hidden ? found.behind : found.place, hidden || found.ahead < 0.0);
#endif
#endif
}
