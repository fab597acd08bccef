// Turns an upright rectangle to the viewer, and chooses the nearest of the views captured all around (Rohlf and Helman 1994).
// Twin: reference/captured_views.py.
// VIEWS: the number of views.
#include "common/captured_box.glsl"
#include "common/per_sample.glsl"
uniform sampler2DArray colour_views;

flat out vec4 rotation;
flat out float level;
flat out uint row;
flat out float layer;
flat out vec3 viewer;           // frame of the rectangle: right, up and toward the viewer, 1 is the radius of the sphere
PER_SAMPLE out vec3 ray;        // from the viewer into the picture, the same frame

const float TURN = 6.28318531;

void main() {
    vec3 from_middle = viewer_from_middle();
    vec3 corner = rectangle_corner(from_middle, gl_VertexID);
    rotation = in_rotation;
    row = uint(in_row + 0.5);
    level = view_level(from_middle, textureSize(colour_views, 0).x);
    gl_Position = clip_from_ray(corner);
    float azimuth = atan(from_middle.x, from_middle.z) / TURN;
    layer = mod(floor(azimuth * float(VIEWS) + 0.5), float(VIEWS));
    vec3 right = view_right(normalize(from_middle)), up = vec3(0.0, 1.0, 0.0);
    mat3 axes = mat3(right, up, cross(right, up));
    viewer = from_middle / sphere_radius * axes;
    ray = corner / sphere_radius * axes;
}
