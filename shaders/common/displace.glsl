// Meso-structure in the vertex stage: what the grid and the pixels can show of it; the rest is left to the normals.
#include "common/meso.glsl"
uniform float meso_spacing;     // metres between the samples of the finest grid
uniform float pixel_angle;      // metres that a pixel covers at one metre

// p: object frame; ease: what part of the depth below its own face applies; distance: of the viewer, in the object's
// metres.
vec3 displaced(vec3 p, int image, float ease, float distance) {
    float footprint = distance * pixel_angle, part = displaced_part(footprint), seen = max(footprint, meso_spacing);
    if (face_of(image) != SIDE) {
        Meso straight = straight_at(p, image, seen);
        p -= ease * part * straight.depth * straight.outward;
    }
    Meso wound = wound_at(p, seen);
    return p - wound_in(p, part * wound.depth) * wound.outward;
}
