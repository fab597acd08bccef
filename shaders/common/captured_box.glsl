// Finds the rectangle in which a viewer sees the box about an object, and the inputs for looking up its captured views.
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;
in float in_row;        // number of the object's row

uniform vec3 box_centre;        // metres, object frame; the middle of all views, too
uniform vec3 box_half_size;
uniform float sphere_radius;    // half the width of each view, metres

// Right and up of a picture taken from a direction, a unit vector toward the viewer; twin: geometry/view_directions.py.
#from depthwalk.geometry.view_directions import POLE
vec3 view_right(vec3 direction) {
    float squared = dot(direction.xz, direction.xz);
    return squared < POLE ? vec3(1.0, 0.0, 0.0) : vec3(direction.z, 0.0, -direction.x) * inversesqrt(squared);
}
mat3 axes_from_direction(vec3 direction) {
    vec3 right = view_right(direction);
    return mat3(right, cross(direction, right), direction);
}

// The viewer, from the object's middle, object frame, metres.
vec3 viewer_from_middle() { return -rotate_back(in_rotation, in_origin) / in_scale - box_centre; }

vec4 clip_from_ray(vec3 ray) { return clip_from_eye * vec4(in_scale * rotate(in_rotation, ray), 1.0); }

// The mip level whose texels are about as large as pixels. texels: on a side of a view.
float view_level(vec3 viewer, int texels) {
    float covered = pixel_angle * length(viewer) * float(texels) / (2.0 * sphere_radius);   // texels under a pixel
    return log2(max(covered, 1e-6));
}

// A corner of the smallest rectangle, at right angles to the line of sight to the object and in front of all of its box,
// through which the viewer sees it; relative to the viewer, object frame. The viewer must be farther from the middle than the
// box's corners.
vec3 rectangle_corner(vec3 viewer, int vertex) {
    const int CORNERS[6] = int[](0, 1, 2, 2, 1, 3);
    int corner = CORNERS[vertex % 6];
    mat3 axes = axes_from_direction(normalize(viewer));
    vec2 low = vec2(1e9), high = vec2(-1e9);
    float nearest = 1e9;
    for (int k = 0; k < 8; ++k) {
        vec3 side = vec3(k & 1, k >> 1 & 1, k >> 2) * 2.0 - 1.0;
        vec3 at = (side * box_half_size - viewer) * axes;
        low = min(low, at.xy / -at.z);
        high = max(high, at.xy / -at.z);
        nearest = min(nearest, -at.z);
    }
    vec2 at = mix(low, high, vec2(corner & 1, corner >> 1));
    return axes * (vec3(at, -1.0) * nearest);
}
