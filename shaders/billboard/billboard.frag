// Shows a captured view on an upright plane through the object's middle, with the depth that the view holds at each pixel
// (Schaufler 1997, "Nailboards"): on the plane itself it would lie in the object's own shadow.
// Twin: reference/captured_views.py.
#include "common/captured_views.glsl"

flat in float layer;
flat in vec3 viewer;
PER_SAMPLE in vec3 ray;

void main() {
    float part = -viewer.z / ray.z;
    ViewTexel texel = view_texel(viewer.xy + part * ray.xy, layer);
    if (texel.coverage < 0.5 || ray.z >= 0.0) discard;
    write_surface(texel.colour, texel.normal, (texel.height - viewer.z) / ray.z);
}
