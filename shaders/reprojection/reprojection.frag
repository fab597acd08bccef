// Shows a finished picture as it appears to a camera that has moved since. Twin: reference/reprojection.py.
//
// Coordinates are those of the picture's camera: right, up and ahead of it, metres. Each pixel looks for the surface on its
// ray by fixed-point steps: how far away the picture's surface is in one place tells in which place to look next (Bowles et
// al. 2012, "Iterative Image Warping"). They begin with what is there if everything is infinitely far, and once more with
// the nearest surface around: a thing may have moved by more than its width.
#from depthwalk.render.reprojection import FIXED_POINT_STEPS
#from depthwalk.render.reprojection import HIDDEN
uniform sampler2D picture;      // sRGB
uniform sampler2D distances;    // metres ahead
uniform sampler2D nearest;      // the least of them in and around each cell
uniform mat3 ray_from_screen;   // takes (x, y, 1), −1 to 1, to the ray of the new camera, one metre long along its axis
uniform vec3 viewer;            // the new camera
uniform vec3 axis;              // its view axis, unit
uniform vec2 half_extent;       // tangents of half the picture's angles
uniform ivec2 margin;           // pixels that the picture has beyond the screen's on each side, of EXACT

in vec2 uv;
layout(location = 0) out vec4 screen;

struct Found {
    vec2 place;         // in the picture
    float ahead;        // how far the picture's surface is there
    float expected;     // how far it should be
    vec2 behind;        // of all places looked at, that of the farthest surface
};

// Beyond the picture's edges, distances go on as they are at the edge.
vec2 place_of(vec3 point) { return 0.5 + 0.5 * point.xy / (max(point.z, 1e-3) * half_extent); }

// Beyond its edges a picture goes on as its mirror image, which looks like more of the same.
vec2 mirrored(vec2 place) { return 1.0 - abs(1.0 - abs(place)); }

// Looks for the surface on a ray, from one that the picture shows in a place.
Found search(vec3 ray, vec2 place, float ahead) {
    float expected = ahead, farthest = ahead;
    vec2 behind = place;
    for (int k = 0; k < FIXED_POINT_STEPS; ++k) {
        vec3 surface = vec3((2.0 * place - 1.0) * half_extent, 1.0) * ahead;
        vec3 point = viewer + max(dot(axis, surface - viewer), 1e-2) * ray;
        place = place_of(point);
        ahead = texture(distances, place).r;
        expected = point.z;
        if (ahead > farthest) { farthest = ahead; behind = place; }
    }
    return Found(place, ahead, expected, behind);
}

void main() {
#ifdef EXACT
    screen = texelFetch(picture, ivec2(gl_FragCoord.xy) + margin, 0);
#else
    vec3 ray = ray_from_screen * vec3(2.0 * uv - 1.0, 1.0);
    vec2 far_place = place_of(ray);
    float far_ahead = texture(distances, far_place).r, near = texture(nearest, far_place).r;
    Found found = search(ray, far_place, far_ahead);
    if (near < HIDDEN * min(found.ahead, far_ahead)) {
        Found other = search(ray, far_place, near);
        if (abs(other.ahead - other.expected) < (1.0 - HIDDEN) * other.expected && other.ahead < found.ahead) found = other;
    }
    // Something nearer stands in the picture where this surface should be: what was behind it was never seen.
    screen = texture(picture, mirrored(found.ahead < HIDDEN * found.expected ? found.behind : found.place));
#endif
}
