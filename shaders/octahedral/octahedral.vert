// Finds the three captured views nearest to the direction of the viewer, and their weights (Brucks 2018, "Octahedral
// impostors"). Twin: reference/captured_views.py.
// VIEWS: along a side of the octahedral map. HEMISPHERE: the map covers only the upper half.
#include "common/captured_box.glsl"
#include "common/per_sample.glsl"
uniform sampler2DArray colour_views;

flat out vec4 rotation;
flat out float level;
flat out uint row;
flat out vec3 weight;
flat out vec3 layer;            // of each view
// The viewer and the ray to the rectangle, in the frame of each view: right, up and toward it, 1 is the radius of the sphere.
flat out vec3 viewer_0, viewer_1, viewer_2;
PER_SAMPLE out vec3 ray_0;
PER_SAMPLE out vec3 ray_1;
PER_SAMPLE out vec3 ray_2;

vec2 square_from_direction(vec3 direction) {
#ifdef HEMISPHERE
    direction.y = max(direction.y, 0.0);
    vec2 p = direction.xz / (abs(direction.x) + direction.y + abs(direction.z));
    return vec2(p.x + p.y, p.x - p.y);
#else
    vec2 p = direction.xz / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    return direction.y < 0.0 ? folded : p;
#endif
}

vec3 direction_from_square(vec2 s) {
#ifdef HEMISPHERE
    vec2 p = 0.5 * vec2(s.x + s.y, s.x - s.y);
    return normalize(vec3(p.x, 1.0 - abs(p.x) - abs(p.y), p.y));
#else
    float upward = 1.0 - abs(s.x) - abs(s.y);
    vec2 folded = (1.0 - abs(s.yx)) * vec2(s.x < 0.0 ? -1.0 : 1.0, s.y < 0.0 ? -1.0 : 1.0);
    vec2 p = upward < 0.0 ? folded : s;
    return normalize(vec3(p.x, upward, p.y));
#endif
}

mat3 view_axes(ivec2 at) {
    return axes_from_direction(direction_from_square(vec2(at) / float(VIEWS - 1) * 2.0 - 1.0));
}

float layer_of(ivec2 at) { return float(at.y * VIEWS + at.x); }

void main() {
    vec3 viewer = viewer_from_middle();
    vec3 ray = rectangle_corner(viewer, gl_VertexID);
    rotation = in_rotation;
    row = uint(in_row + 0.5);
    level = view_level(viewer, textureSize(colour_views, 0).x);
    gl_Position = clip_from_ray(ray);

    vec2 grid = (square_from_direction(normalize(viewer)) * 0.5 + 0.5) * float(VIEWS - 1);
    ivec2 cell = clamp(ivec2(floor(grid)), ivec2(0), ivec2(VIEWS - 2));
    vec2 within = grid - vec2(cell);
    ivec2 opposite = ivec2(1);  // corner, from the first one
#ifndef HEMISPHERE
    // Cells are divided into triangles along the fold, so that all three views are of one face of the octahedron.
    ivec2 centre = 2 * cell + 2 - VIEWS;
    if (centre.x * centre.y > 0) {
        within.x = 1.0 - within.x;
        cell.x += 1;
        opposite.x = -1;
    }
#endif
    ivec2 side = opposite * (within.x > within.y ? ivec2(1, 0) : ivec2(0, 1));
    weight = vec3(1.0 - max(within.x, within.y), abs(within.x - within.y), min(within.x, within.y));
    layer = vec3(layer_of(cell), layer_of(cell + side), layer_of(cell + opposite));
    vec3 scaled = viewer / sphere_radius, towards = ray / sphere_radius;
    mat3 axes = view_axes(cell);
    viewer_0 = scaled * axes;
    ray_0 = towards * axes;
    axes = view_axes(cell + side);
    viewer_1 = scaled * axes;
    ray_1 = towards * axes;
    axes = view_axes(cell + opposite);
    viewer_2 = scaled * axes;
    ray_2 = towards * axes;
}
