// Finds the surface behind a pixel by sphere tracing: each step along the view ray is as long as the distance to the surface in
// a volume (Donnelly 2005). If the steps do not suffice, the last point is shown, as published.
// STEPS: most steps of the ray; it stops early behind the surface or outside the box. Twin:
// reference/height_field.py.
#include "common/height_field.glsl"
#include "common/field_frame.glsl"
uniform sampler3D distances;    // metres, 0 behind the surface

void main() {
    FieldRay ray = field_ray();
    if (!starts_in_front(ray)) discard;
    float metres = length(ray.way * field_size), part = 0.0;
    for (int k = 0; k < STEPS; ++k) {
        float clear = texture(distances, ray.start + part * ray.way).r;
        part += clear / metres;
        if (clear <= 0.0 || part > 1.0) break;
    }
    part = min(part, 1.0);
    if (part == 1.0 && behind_surface(ray, 1.0) < 0.0) discard;     // it left by a side, or by the back without hitting a surface
    if (surface_depth((ray.start + part * ray.way).xy) > 1.0) discard;
    write_hit(ray, part);
}
