// Traces rays from a pixel's point of the focal plane to points of the lens through the circles of confusion (Lee, Eisemann
// and Seidel 2010). Where the circle is c, a ray to the point u of the unit disc passes c·u beside the pixel. So it hits the
// surface that has the circle c at that place. Rays start at the nearest, as surfaces in front hide those behind. The including
// shader defines `float circle_near(vec2)`, the circle of the pixel at a place of the picture. Twin: reference/dof.py.
#from depthwalk.render.view.lens import SHARP_RADIUS, RAY_STRIDE, HIDDEN_WEIGHT
#include "dof/disc.glsl"

// The place in the picture at which a ray ends, pixels, and its weight. middle: of the pixel; own: its circle, where all rays
// end that hit nothing before. The surface that a ray hits may be hidden from the viewer. Then the farthest surface that it
// passed behind the pixel's own is used instead; if there was none, the ray has next to no weight.
vec3 traced(vec2 middle, vec2 lens, float own, vec2 range) {
    float stride = RAY_STRIDE / max(length(lens), 0.05);
    float before = ceil((own - range.x) / stride), after = ceil((range.y - own) / stride);
    float last = -1e4, deepest = own + 2.0 * SHARP_RADIUS;
    vec3 end = vec3(middle, HIDDEN_WEIGHT);
    for (float k = -before; k <= after; ++k) {
        float circle = own + (k < 0.0 ? (own - range.x) * k / before : (range.y - own) * k / max(after, 1.0));
        vec2 at = middle + circle * lens;
        float found = circle_near(at);
        if (found <= circle + SHARP_RADIUS && found >= last - SHARP_RADIUS) {
            // Hit since the last step, unless the ray came out from behind another surface.
            vec2 met = middle + found * lens;
            if (abs(circle_near(met) - found) <= 2.0 * SHARP_RADIUS)
                return vec3(mix(floor(met) + 0.5, met, clamp(abs(found) / SHARP_RADIUS - 1.0, 0.0, 1.0)), 1.0);
        }
        if (found > deepest) {
            deepest = found;
            end = vec3(floor(at) + 0.5, 1.0);
        }
        last = circle;
    }
    return end;
}
