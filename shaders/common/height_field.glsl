// Follows view rays through the box about a height field, and writes where they meet its surface. Twin:
// reference/height_field.py.
//
// The surface is seen from outside only: a ray hits it where it passes from the front to the back. Texels without a surface are
// infinitely deep, and there are no walls where they, or the edges of the field, begin.
#from depthwalk.bake.images import Face
#from depthwalk.cook.lod_geometry import FACE_SHIFT
#include "common/per_sample.glsl"
#include "common/view.glsl"
#include "common/visibility.glsl"
uniform sampler2D height_field;     // depth, 0 to 1; more where there is no surface
uniform vec2 field_margin;

flat in uint object;
flat in vec3 viewer;
PER_SAMPLE in vec3 entry;

layout(location = 0) out uvec2 visibility;
#ifdef CONSERVATIVE_DEPTH
layout(depth_greater) out float gl_FragDepth;   // all surface lies within the box
#endif

// From where a view ray enters the box to where it leaves it, field coordinates.
struct FieldRay {
    vec3 start;
    vec3 way;
    float reach;        // length of the way, where 1 is the viewer's distance from the start
};

FieldRay field_ray() {
    vec3 direction = entry - viewer;
    direction = mix(direction, vec3(1e-9), lessThan(abs(direction), vec3(1e-9)));
    vec3 low = vec3(field_margin, 0.0), high = vec3(1.0 - field_margin, 1.0);
    vec3 leaves = (mix(low, high, greaterThan(direction, vec3(0.0))) - entry) / direction;
    float reach = max(min(leaves.x, min(leaves.y, leaves.z)), 0.0);
    return FieldRay(entry, direction * reach, reach);
}

float surface_depth(vec2 uv) { return textureLod(height_field, uv, 0.0).r; }

// How far behind the surface the ray is after `part` of its way, as a part of the object's depth; negative in front of it.
float behind_surface(FieldRay ray, float part) {
    vec3 at = ray.start + part * ray.way;
    return at.z - surface_depth(at.xy);
}

// Whether the ray is in front of the surface where it enters the box; it always is at the front face.
bool starts_in_front(FieldRay ray) { return ray.start.z < 1e-6 || behind_surface(ray, 0.0) < 0.0; }

// Whether the ray comes from where there is no surface, so that it would hit the edge of one.
bool beside_surface(FieldRay ray, float part) { return surface_depth((ray.start + part * ray.way).xy) > 1.0; }

// Writes that the pixel shows the surface after `part` of the ray's way.
void write_hit(FieldRay ray, float part) {
    float inverse = gl_FragCoord.w / (1.0 + part * ray.reach);
    visibility = visibility_from(object, uint(FACE_TOP << FACE_SHIFT), inverse);
    gl_FragDepth = max(depth_from_inverse.x - depth_from_inverse.y * inverse, gl_FragCoord.z);  // greater despite rounding
}
