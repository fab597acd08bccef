// Draws the box about a height field, all faces but its back, from the field's coordinates to clip space.
#include "common/per_sample.glsl"
#include "common/field_frame.glsl"
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

uniform vec2 field_margin;  // half a texel: the surface ends at the centres of the outermost texels
uniform uint first;         // number of the first object

flat out uint object;
flat out vec3 viewer;           // field coordinates
PER_SAMPLE out vec3 entry;      // where the view ray enters the box, field coordinates

// Two triangles to a face, counter-clockwise seen from outside, where u × v points inward: first the front at depth 0.
vec3 box_corner(int vertex) {
    const int CORNERS[6] = int[](0, 1, 2, 2, 1, 3);
    int face = vertex / 6, corner = CORNERS[vertex % 6];
    vec2 at = vec2(corner & 1, corner >> 1);
    if (face == 0) return vec3(at.yx, 0.0);
    if (face == 1) return vec3(0.0, at.yx);
    if (face == 2) return vec3(1.0, at);
    if (face == 3) return vec3(at.x, 0.0, at.y);
    return vec3(at.y, 1.0, at.x);
}

void main() {
    object = first + uint(gl_InstanceID);
    viewer = field_from_object(-rotate_back(in_rotation, in_origin) / in_scale);
    vec3 corner = box_corner(gl_VertexID);
    entry = vec3(clamp(corner.xy, field_margin, 1.0 - field_margin), corner.z);
    gl_Position = clip_from_eye * vec4(in_origin + in_scale * rotate(in_rotation, object_from_field(entry)), 1.0);
}
