// Shows a finished picture as it appears to a camera that has moved since. Twin: reference/reprojection.py.
//
// Coordinates are those of the picture's camera: right, up and ahead of it, metres. Each pixel looks for the surface on its ray
// by fixed-point steps: what the picture shows in one place tells how far away the surface is, and that, in which place to look
// (Bowles et al. 2012, "Iterative Image Warping").
#from depthwalk.render.reprojection import STEPS
#from depthwalk.render.reprojection import HIDDEN
uniform sampler2D picture;      // sRGB
uniform sampler2D distances;    // metres ahead
uniform mat3 ray_from_screen;   // takes (x, y, 1), −1 to 1, to the ray of the new camera, one metre long along its axis
uniform vec3 viewer;            // the new camera
uniform vec3 axis;              // its view axis, unit
uniform vec2 half_extent;       // tangents of half the picture's angles
uniform ivec2 margin;           // pixels that the picture has beyond the screen's on each side, of EXACT

in vec2 uv;
layout(location = 0) out vec4 screen;

vec2 place_of(vec3 point) { return 0.5 + 0.5 * point.xy / (max(point.z, 1e-3) * half_extent); }

vec3 point_at(vec2 place, float ahead) { return vec3((2.0 * place - 1.0) * half_extent, 1.0) * ahead; }

void main() {
#ifdef EXACT
    screen = texelFetch(picture, ivec2(gl_FragCoord.xy) + margin, 0);
#else
    vec3 ray = ray_from_screen * vec3(2.0 * uv - 1.0, 1.0);
    vec2 place = clamp(place_of(ray), 0.0, 1.0);    // as if everything were infinitely far
    vec2 farthest_place = place;
    float ahead = texture(distances, place).r, farthest = ahead;
    float expected = ahead;
    for (int k = 0; k < STEPS; ++k) {
        float along = max(dot(axis, point_at(place, ahead) - viewer), 1e-2);
        vec3 point = viewer + along * ray;
        place = clamp(place_of(point), 0.0, 1.0);
        ahead = texture(distances, place).r;
        expected = point.z;
        if (ahead > farthest) { farthest = ahead; farthest_place = place; }
    }
    // Something nearer stands in the picture where this surface should be: what was behind it was never seen.
    screen = texture(picture, ahead < HIDDEN * expected ? farthest_place : place);
#endif
}
