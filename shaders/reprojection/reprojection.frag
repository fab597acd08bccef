// Shows a finished picture as it appears to a camera that has moved since. Twin: reference/reprojection.py.
//
// EXACT: the camera is that of the picture; TURNED: it is at the same position. AROUND: beyond the picture's edges, shows what
// earlier pictures saw there. COVERED: see search.glsl. MOVED: something may show that moves by itself. DISTANCE: writes how far
// ahead the surface at one place of the screen is, not its colour.
#from depthwalk.render.reprojection.reprojection import BEYOND, REFLECTED
#include "reprojection/search.glsl"
#ifdef AROUND
#include "reprojection/surround.glsl"
uniform mat3 world_from_screen; // takes (x, y, 1), −1 to 1, to the ray of the new camera, world
#endif
uniform sampler2D picture;      // sRGB
uniform vec2 pixel;             // of the screen, as a part of it
uniform ivec2 margin;           // with EXACT: pixels by which the picture is wider than the screen on each side

#ifdef DISTANCE
uniform vec2 place_asked; // 0 to 1 over the screen, to the right and up
layout(location = 0) out float distance_shown; // metres along the new camera's axis; BEYOND where nothing is
#define uv place_asked
#else
layout(location = 0) out vec4 screen;
#define uv (gl_FragCoord.xy * pixel)
#endif

// Beyond its edges, where no earlier picture has seen anything either, a picture is continued by mirroring its border, to and
// fro: more of the same, and no sky where ground must be.
vec2 mirrored(vec2 place) {
    vec2 inside = clamp(place, 0.0, 1.0);
    vec2 beyond = mod(abs(place - inside), 2.0 * REFLECTED);
    return abs(inside - min(beyond, 2.0 * REFLECTED - beyond));
}

// Returns the colour of the picture, or of its surround, at a place. alone: not blended with its neighbours.
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
    Found found = surface_on(ray, uv);
#ifdef DISTANCE
    vec2 place = mirrored(place_shown(ray, found));
    float ahead = abs(texture(distances, place).r);
    distance_shown = ahead < BEYOND ? seen_ahead(place, ahead, shift_at(place).xyz) : BEYOND;
#else
    // Beside a nearer surface a pixel is not filtered: a blend of four would include that surface's edge.
    vec2 place = place_shown(ray, found);
    screen = colour_at(place, is_hidden(found) || place != found.place || found.ahead < 0.0);
#endif
#endif
}
