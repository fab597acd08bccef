// Shows the plane of the picture at each pixel; only its normals give the impression of relief (Blinn 1978).
#include "common/height_field.glsl"

void main() {
    if (surface_depth(entry.xy) > 1.0) discard;
    write_hit(field_ray(), 0.0);
}
