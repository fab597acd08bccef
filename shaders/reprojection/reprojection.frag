// Shows a finished picture as it appears to a camera that has moved since. Twin: reference/reprojection.py.
//
// Coordinates are those of the picture's camera: right, up and ahead of it, metres. Each pixel looks for the surface on its
// ray by fixed-point steps: how far away the picture's surface is in one place tells in which place to look next (Bowles et
// al. 2012, "Iterative Image Warping"). They begin with the nearest surface that has come there, since a thing may have moved
// by more than its width: a ray that misses it meets what is behind it in the next step.
// EXACT: the camera is that of the picture; TURNED: it stands where that stood. AROUND: what lies beyond the picture's edges is
// what earlier pictures saw there. DISTANCE: how far ahead the surface is that one place of the screen shows, not its colour.
#from depthwalk.render.reprojection import BEYOND, FIXED_POINT_STEPS
#from depthwalk.render.reprojection import HIDDEN
#from depthwalk.render.reprojection import REFLECTED
#ifdef AROUND
#include "reprojection/surround.glsl"
uniform mat3 world_from_screen; // takes (x, y, 1), −1 to 1, to the ray of the new camera, world
#endif
uniform sampler2D picture;      // sRGB
uniform sampler2D distances;    // metres ahead, negative beside what is nearer
uniform sampler2D nearest;      // the least of them ahead of the new camera, by cells of the screen
uniform vec2 cells_shown;       // part of these cells that the screen covers, to the right and up
uniform mat3 ray_from_screen;   // takes (x, y, 1), −1 to 1, to the ray of the new camera, one metre long along its axis
uniform vec3 viewer;            // the new camera
uniform vec3 axis;              // its view axis, unit
uniform vec2 half_extent;       // tangents of half the picture's angles
uniform ivec2 margin;           // pixels that the picture has beyond the screen's on each side, of EXACT

#ifdef DISTANCE
uniform vec2 place_asked; // 0 to 1 over the screen, to the right and up
layout(location = 0) out float distance_shown; // metres along the new camera's axis; BEYOND where nothing is
#define uv place_asked
#else
in vec2 uv;
layout(location = 0) out vec4 screen;
#endif

struct Found {
    vec2 place;         // in the picture
    float ahead;        // how far the picture's surface is there, as `distances` have it
    float expected;     // how far it should be
    vec2 behind;        // of all places looked at, that of the farthest surface
};

// Beyond the picture's edges, distances go on as they are at the edge.
vec2 place_of(vec3 point) { return 0.5 + 0.5 * point.xy / (max(point.z, 1e-3) * half_extent); }

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

// Looks for the surface on a ray, from a place in the picture.
Found search(vec3 ray, vec2 place) {
    float ahead = texture(distances, place).r, expected = abs(ahead), farthest = expected;
    vec2 behind = place;
    for (int k = 0; k < FIXED_POINT_STEPS; ++k) {
        vec3 surface = vec3((2.0 * place - 1.0) * half_extent, 1.0) * abs(ahead);
        vec3 point = viewer + max(dot(axis, surface - viewer), 1e-2) * ray;
        place = place_of(point);
        ahead = texture(distances, place).r;
        expected = point.z;
        if (abs(ahead) > farthest) { farthest = abs(ahead); behind = place; }
    }
    return Found(place, ahead, expected, behind);
}

void main() {
#if defined EXACT
    screen = texelFetch(picture, ivec2(gl_FragCoord.xy) + margin, 0);
#elif defined TURNED
    screen = colour_at(place_of(ray_from_screen * vec3(2.0 * uv - 1.0, 1.0)), false);
#else
    vec3 ray = ray_from_screen * vec3(2.0 * uv - 1.0, 1.0);
    vec3 near = viewer + texture(nearest, uv * cells_shown).r * ray;
    Found found = search(ray, place_of(near));
    // Something nearer stands in the picture where this surface should be: what was behind it was never seen.
    bool hidden = abs(found.ahead) < HIDDEN * found.expected;
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
