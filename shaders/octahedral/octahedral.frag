// Blends three captured views of an object, each shifted by its own depth (Brucks 2018, "Octahedral impostors"). Twin:
// reference/captured_views.py.
// STEPS: how often each view is shifted; published: 1.
#include "common/captured_views.glsl"

flat in vec3 weight;
flat in vec3 layer;
flat in vec3 viewer_0, viewer_1, viewer_2;
PER_SAMPLE in vec3 ray_0;
PER_SAMPLE in vec3 ray_1;
PER_SAMPLE in vec3 ray_2;

float coverage = 0.0, part = 0.0;
vec3 colour = vec3(0.0), normal = vec3(0.0);

// Follows the ray to the plane of a view, looks up the surface's height above that plane, and follows the ray to this height.
void add_view(vec3 viewer, vec3 ray, float number, float share) {
    vec2 at = viewer.xy - viewer.z / ray.z * ray.xy;
    for (int k = 0; k < STEPS; ++k) at = viewer.xy + (height_in(at, number) - viewer.z) / ray.z * ray.xy;
    ViewTexel texel = view_texel(at, number);
    share *= texel.coverage;
    coverage += share;
    colour += share * texel.colour;
    normal += share * texel.normal;
    part += share * (texel.height - viewer.z) / ray.z;
}

void main() {
    add_view(viewer_0, ray_0, layer.x, weight.x);
    add_view(viewer_1, ray_1, layer.y, weight.y);
    add_view(viewer_2, ray_2, layer.z, weight.z);
    if (coverage < 0.5) discard;
    write_surface(colour / coverage, normal, part / coverage);
}
