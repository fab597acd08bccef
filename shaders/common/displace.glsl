// Meso-structure in the vertex stage: what the grid and the pixels can show of it; the rest is left to the normals.
#include "common/meso.glsl"
uniform float meso_spacing;     // metres between the samples of the finest grid
uniform float meso_fade;        // pixels: relief that covers fewer is not displaced
uniform float pixel_angle;      // metres that a pixel covers at one metre

// p: object frame; ease: what part of the depth applies; distance: of the viewer, in the object's metres.
vec3 displaced(vec3 p, int image, float ease, float distance) {
    float footprint = distance * pixel_angle;
    Meso meso = meso_at(p, image, max(footprint, meso_spacing));
    float fade = clamp(meso_height / max(footprint * meso_fade, 1e-9) - 1.0, 0.0, 1.0);
    return p - ease * fade * meso.depth * meso.outward;
}
