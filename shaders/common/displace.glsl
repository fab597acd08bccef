// Displaces depth samples by the object's meso-structure before they are warped, in the object frame (Liu, Liu and Wu 2007,
// §3.4), as far as grid and pixels can show it; the rest is left to the normals. Without MESO samples stay in place.
#include "common/samples.glsl"
#include "common/meso.glsl"
#include "common/view.glsl"

// texel: the sample; point: its position; away: distance of the viewer from it, in the object's metres.
vec3 displaced(uvec4 texel, vec3 point, float away) {
#ifdef MESO
    int image = int(sample_image(texel));
    float footprint = away * pixel_angle, part = displaced_part(footprint), seen = max(footprint, meso_spacing);
    if (face_of(image) != FACE_SIDE) {
        Meso straight = straight_at(point, image, seen);
        point -= sample_ease(texel) * part * straight.depth * straight.outward;
    }
    Meso wound = wound_at(point, seen);
    point -= wound_in(point, part * wound.depth) * wound.outward;
#endif
    return point;
}
