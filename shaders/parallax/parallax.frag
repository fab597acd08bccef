// Finds the surface behind a pixel by parallax occlusion mapping: linear steps, more of them for rays at grazing angles, then
// one secant between the last two (Tatarchuk 2006). Rays that leave the picture by its sides show the surface there.
// MIN_STEPS, MAX_STEPS: for rays perpendicular to the picture and along it. Twin: reference/height_field.py.
#include "common/height_field.glsl"
#include "common/field_frame.glsl"

void main() {
    FieldRay ray = field_ray();
    float cosine = normalize(ray.way * field_size).z;
    int steps = int(mix(float(MAX_STEPS), float(MIN_STEPS), cosine));
    float part = 0.0, last = min(behind_surface(ray, 0.0), 0.0), now = last;
    for (int k = 1; k <= steps; ++k) {
        part = float(k) / float(steps);
        now = behind_surface(ray, part);
        if (now >= 0.0) break;
        last = now;
    }
    if (now >= 0.0) part -= now / (now - last + 1e-12) / float(steps);
    if (surface_depth((ray.start + part * ray.way).xy) > 1.0) discard;
    write_hit(ray, part);
}
