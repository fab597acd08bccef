// Finds the place in a finished picture of what a camera that has moved since sees. Twin: reference/reprojection.py.
//
// Coordinates are those of the picture's camera: right, up and ahead of it, metres. The surface on a ray is found by
// fixed-point iteration: the distance of the picture's surface at one place determines the next place to look at (Bowles et al.
// 2012, "Iterative Image Warping"). It starts with the nearest surface that may have moved there, since an object may have
// moved by more than its width: a ray that misses it hits what is behind it in the next step.
//
// For a viewer who has moved ahead that iteration does not converge on a floor nearer than the way that was gone: it finds the
// floor behind the viewer, and then what is at the vanishing point. So steps are damped, see `next_along`.
#from depthwalk.render.reprojection.reprojection import FIXED_POINT_STEPS, HIDDEN, DAMPING
uniform sampler2D distances;    // metres ahead, negative beside a nearer surface
uniform sampler2D nearest;      // the least of them ahead of the new camera, by cells of the screen
uniform vec2 cells_shown;       // part of these cells that the screen covers, to the right and up
uniform mat3 ray_from_screen;   // takes (x, y, 1), −1 to 1, to the ray of the new camera, one metre long along its axis
uniform vec3 viewer;            // the new camera
uniform vec3 axis;              // its view axis, unit
uniform vec2 half_extent;       // tangents of half the picture's angles

struct Found {
    vec2 place;         // in the picture
    float ahead;        // how far the picture's surface is there, as `distances` have it
    float expected;     // how far it should be
    vec2 behind;        // the place with the farthest surface of all that were visited
};

// Beyond the picture's edges, distances go on as they are at the edge.
vec2 place_of(vec3 point) { return 0.5 + 0.5 * point.xy / (max(point.z, 1e-3) * half_extent); }

vec3 ray_at(vec2 place) { return ray_from_screen * vec3(2.0 * place - 1.0, 1.0); }

// Returns how far along the ray the nearest surface is that may have moved to a place of the screen.
float nearest_along(vec2 place) { return texture(nearest, place * cells_shown).r; }

// Returns how far along a ray to look next. along: how far the last look was, a point that is `expected` metres ahead of the
// picture's camera, in whose place the picture shows a surface `ahead` metres away.
//
// The surface itself, seen from the new camera, is right for a wall across the way. Where the viewer has moved ahead, the
// last look scaled like its distance is right for a floor or wall beside the way. The geometric mean does for both.
float next_along(float along, float expected, float ahead, vec2 place) {
    float seen = dot(axis, vec3((2.0 * place - 1.0) * half_extent, 1.0) * ahead - viewer);
    if (dot(axis, viewer) <= 0.0 || expected <= 0.0) return max(seen, 1e-2);
    float scaled = along * ahead / expected;
    return max(sqrt(max(seen, DAMPING * scaled) * scaled), 1e-2);
}

// Looks for the surface on a ray, first at a distance along it.
Found search(vec3 ray, float along) {
    vec3 point = viewer + along * ray;
    vec2 place = place_of(point), behind = place;
    float ahead = texture(distances, place).r, expected = point.z, farthest = abs(ahead);
    for (int k = 0; k < FIXED_POINT_STEPS; ++k) {
        along = next_along(along, expected, abs(ahead), place);
        point = viewer + along * ray;
        place = place_of(point);
        ahead = texture(distances, place).r;
        expected = point.z;
        if (abs(ahead) > farthest) { farthest = abs(ahead); behind = place; }
    }
    return Found(place, ahead, expected, behind);
}

// Returns whether the picture has something nearer where a surface should be, so that the surface was never seen.
bool is_hidden(Found found) { return abs(found.ahead) < HIDDEN * found.expected; }
