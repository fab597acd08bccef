// Looks up the surface that a viewer sees at a point of an object, in the object frame.
#include "common/depth_images.glsl"

// No visible surface faces away from the viewer, but its normal may: by less than 20° where it is blended at silhouettes, or where
// a thin wall's other side is looked up; and by any angle on simplified leaves, whose two sides are one surface that looks up the
// normal of either, which left black specks on bushes. Beyond this cosine it is flipped; below, the nearest normal that does not
// face away takes its place, or light from behind would show on single pixels. Relief keeps its normal: where it is steeper than
// displaced, it is in its own shadow. KEEPS_NORMALS: so does the relief of normal maps.
const float AVERTED = 0.35;

// normal: unit, as looked up; view: unit, from the viewer to the surface.
vec3 seen_normal(vec3 normal, vec3 view) {
    float averted = dot(normal, view);
    if (averted > AVERTED) return -normal;
    return averted > 0.0 ? normalize(normal - averted * view) : normal;
}

// image, footprint: as for `surface_at`; view: unit, from the viewer to p.
Surface seen_surface(vec3 p, int image, float footprint, vec3 view) {
    Surface surface = surface_at(p, image, footprint, view);
#if !defined MESO && !defined KEEPS_NORMALS
    surface.normal = seen_normal(surface.normal, view);
#endif
    return surface;
}
