// Draws the rectangle of the picture's plane that a pre-warped image covers (Oliveira, Bishop and McAllister 2000).
#include "common/per_sample.glsl"
#include "common/field_frame.glsl"
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;
in vec2 in_low;         // middle of the image's first texel, texels of the picture
in vec2 in_step;        // from one of its texels to the next
in vec2 in_count;       // of its texels

uniform vec2 field_margin;  // half a texel of the picture
uniform uint first;         // number of the first object

flat out uint object;
flat out int layer;
flat out ivec2 texels;
PER_SAMPLE out vec2 texel;      // of the image; 0 at the centre of the first one

void main() {
    const int CORNERS[6] = int[](0, 1, 2, 2, 1, 3);
    int corner = CORNERS[gl_VertexID];
    object = first + uint(gl_InstanceID);
    layer = gl_InstanceID;
    texels = ivec2(in_count);
    texel = vec2(corner >> 1, corner & 1) * in_count - 0.5;
    vec2 at = (in_low + in_step * texel + 0.5) * 2.0 * field_margin;
    gl_Position = clip_from_eye * vec4(in_origin + in_scale * rotate(in_rotation, object_from_field(vec3(at, 0.0))), 1.0);
}
