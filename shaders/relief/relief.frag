// Finds the surface behind a pixel by relief mapping: a linear search along the view ray for a point behind the surface, then
// a binary search between it and the one before (Policarpo, Oliveira and Comba 2005).
// LINEAR_STEPS, BINARY_STEPS: of the two searches. The linear one stops when it has found a point, unlike the published
// program, whose hardware could not leave loops early.
#include "common/height_field.glsl"

void main() {
    FieldRay ray = field_ray();
    float part = 0.0;
    bool in_front = starts_in_front(ray), found = false;
    for (int k = 1; k <= LINEAR_STEPS && !found; ++k) {
        part = float(k) / float(LINEAR_STEPS);
        bool behind = behind_surface(ray, part) >= 0.0;
        found = behind && in_front;
        in_front = !behind;
    }
    if (!found) discard;
    float before = part - 1.0 / float(LINEAR_STEPS);
    for (int k = 0; k < BINARY_STEPS; ++k) {
        float middle = 0.5 * (before + part);
        if (behind_surface(ray, middle) >= 0.0) part = middle;
        else before = middle;
    }
    if (beside_surface(ray, before)) discard;
    write_hit(ray, part);
}
