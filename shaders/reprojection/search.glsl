// Finds the place in a finished picture of what a camera that has moved since sees. Twin: reference/reprojection.py.
//
// Coordinates are those of the picture's camera: right, up and ahead of it, metres. The surface on a ray is found by
// fixed-point iteration: the distance of the picture's surface at one place determines the next place to look at (Bowles et al.
// 2012, "Iterative Image Warping"). It starts with the nearest surface that may have moved there, since an object may have
// moved by more than its width: a ray that misses it hits what is behind it in the next step.
//
// For a viewer who has moved ahead that iteration does not converge on a floor nearer than the way that was gone: it finds the
// floor behind the viewer, and then what is at the vanishing point. So steps are damped, see `next_along`.
//
// COVERED, or `covered` with DISTANCE: a search without a look midway finds all that shows.
#from depthwalk.render.reprojection.reprojection import FIXED_POINT_STEPS, HIDDEN, DAMPING, EDGE, EDGE_STEPS
uniform sampler2D distances;    // metres ahead, negative beside a nearer surface
uniform sampler2D nearest;      // the least of them ahead of the new camera, by cells of the screen
uniform vec2 cells_shown;       // part of these cells that the screen covers, to the right and up
uniform mat3 ray_from_screen;   // takes (x, y, 1), −1 to 1, to the ray of the new camera, one metre long along its axis
uniform vec3 viewer;            // the new camera
uniform vec3 axis;              // its view axis, unit
uniform vec2 half_extent;       // tangents of half the picture's angles
#ifdef MOVED
uniform sampler2D velocities;   // of surfaces that move by themselves, m/s (velocity.frag)
uniform float elapsed;          // seconds since the picture's moment
uniform sampler2D nearest_moved;    // the nearest of these ahead of the new camera, by cells of the screen; gba: its `shift_at`
#endif

#ifdef DISTANCE
uniform bool covered;
#elif defined COVERED
const bool covered = true;
#else
const bool covered = false;
#endif

struct Found {
    vec2 place;         // in the picture
    float ahead;        // how far the picture's surface is there, as `distances` have it
    float expected;     // how far it should be
    float along;        // how far along the ray that is
    vec2 behind;        // the place with the farthest surface of all that were visited
    vec3 passed;        // there: `ahead` without its sign, `expected` and `along`
    float assumed, moves;   // whether it moves by itself: as the search took it to do, and as it does; 1 if so
};

// Beyond the picture's edges, distances go on as they are at the edge.
vec2 place_of(vec3 point) { return 0.5 + 0.5 * point.xy / (max(point.z, 1e-3) * half_extent); }

vec3 ray_at(vec2 place) { return ray_from_screen * vec3(2.0 * place - 1.0, 1.0); }

// Returns how far along the ray the nearest surface is that may have moved to a place of the screen.
float nearest_along(vec2 place) { return texture(nearest, place * cells_shown).r; }

// Returns by how much the surface at a place of the picture has moved by itself since, metres; w: 1 where it moves, else 0.
vec4 shift_at(vec2 place) {
#ifdef MOVED
    return texture(velocities, place) * vec4(vec3(elapsed), 1.0);
#else
    return vec4(0.0);
#endif
}

// Returns how far ahead of the new camera a surface is that the picture shows `ahead` metres away, and that has moved by `shift`.
float seen_ahead(vec2 place, float ahead, vec3 shift) {
    return dot(axis, vec3((2.0 * place - 1.0) * half_extent, 1.0) * ahead + shift - viewer);
}

// Returns how far along a ray to look next. along: how far the last look was, a point that is `expected` metres ahead of the
// picture's camera, in whose place the picture shows a surface `ahead` metres away that has moved by `shift`.
//
// The surface itself, seen from the new camera, is right for a wall across the way. Where the viewer has moved ahead, the
// last look scaled like its distance is right for a floor or wall beside the way. The geometric mean does for both.
float next_along(float along, float expected, float ahead, vec2 place, vec3 shift) {
    float seen = seen_ahead(place, ahead, shift);
    if (dot(axis, viewer) <= 0.0 || expected <= 0.0) return max(seen, 1e-2);
    float scaled = along * ahead / expected;
    return max(sqrt(max(seen, DAMPING * scaled) * scaled), 1e-2);
}

// Looks for the surface on a ray, first at a distance along it, for one that has moved by `shift`. Where a surface has moved by
// itself, the picture shows it in the place that it came from.
//
// midway: a long first step goes half as far, in inverse distance, as something narrow may be in between; one more follows.
Found search(vec3 ray, float along, vec4 shift, bool midway) {
    vec3 point = viewer + along * ray - shift.xyz;
    vec2 place = place_of(point), behind = place;
    float ahead = texture(distances, place).r, expected = point.z;
    vec3 passed = vec3(abs(ahead), expected, along);
    for (int k = midway ? -1 : 0; k < FIXED_POINT_STEPS; ++k) {
        shift = shift_at(place);
        float next = next_along(along, expected, abs(ahead), place, shift.xyz);
        along = k < 0 && next > EDGE * along ? 2.0 / (1.0 / along + 1.0 / next) : next;
        point = viewer + along * ray - shift.xyz;
        place = place_of(point);
        ahead = texture(distances, place).r;
        expected = point.z;
        if (abs(ahead) > passed.x) { passed = vec3(abs(ahead), expected, along); behind = place; }
    }
    return Found(place, ahead, expected, along, behind, passed, shift.w, shift_at(place).w);
}

// Returns whether the picture has something nearer where a surface should be, or something that has left.
bool is_hidden(Found found) {
    return abs(found.ahead) < HIDDEN * found.expected || found.assumed < found.moves;
}

// Returns whether the search has ended at no surface.
bool is_lost(Found found) { return is_hidden(found) || HIDDEN * abs(found.ahead) > found.expected; }

// Returns the place of the picture to show on a ray, from what the search has found there.
//
// Where the search is lost, the farthest surface that it passed is shown where it goes on to the ray. If that is behind a nearer
// one, the picture lacks what the ray shows. Then what is beside the nearer one is shown as it is at the edge, which is found by
// bisection. Where the search passed it, it is as far from the edge as the ray is: all that is there would be shown twice.
vec2 place_shown(vec3 ray, Found found) {
    vec2 place = is_hidden(found) ? found.behind : found.place;
    if (covered || !is_lost(found)) return place;
    vec3 shift = shift_at(found.behind).xyz;
    float along = next_along(found.passed.z, found.passed.y, found.passed.x, found.behind, shift);
    vec3 point = viewer + along * ray - shift;
    vec2 low = found.behind, high = place_of(point);
    float nearer = abs(texture(distances, high).r), edge = min(sqrt(nearer * found.passed.x), EDGE * nearer);
    if (nearer >= HIDDEN * point.z || high != clamp(high, 0.0, 1.0)) return high; // seen, or past its edges
    shift = shift_at(high).xyz;
    vec2 nearest = place_of(viewer + next_along(along, point.z, nearer, high, shift) * ray - shift);
    if (abs(texture(distances, nearest).r) < edge) return nearest;
    for (int k = 0; k < EDGE_STEPS; ++k) {
        vec2 between = 0.5 * (low + high);
        if (abs(texture(distances, between).r) > edge) low = between;
        else high = between;
    }
    return low;
}

// Returns what is on the ray through a place of the screen: the nearer of what a search for a surface that stays finds, and one
// for a surface that may have come there by itself.
Found surface_on(vec3 ray, vec2 place) {
    Found stays = search(ray, nearest_along(place), vec4(0.0), !covered);
#ifdef MOVED
    vec4 start = texture(nearest_moved, place * cells_shown);
    Found came = search(ray, start.x, vec4(start.yzw, 1.0), false);
    bool is_there = came.assumed > 0.0 && came.moves > 0.0 && abs(abs(came.ahead) - came.expected) < (1.0 - HIDDEN) * came.expected;
    if (is_there && (is_hidden(stays) || came.along < stays.along)) return came;
#endif
    return stays;
}
