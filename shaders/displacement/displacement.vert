// Displaces the vertices of a grid, one to each texel of a height field, from the object frame to clip space (Cook, Carpenter and
// Catmull 1987: micropolygons).
#from depthwalk.bake.images import Face
#from depthwalk.cook.lod_geometry import FACE_SHIFT
#include "common/per_sample.glsl"
#include "common/field_frame.glsl"
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

uniform sampler2D height_field;     // depth, 0 to 1
uniform vec2 field_margin;
uniform uint first;                 // number of the first object

flat out uint object;
flat out uint image;
PER_SAMPLE out float forward;       // metres along the view axis

void main() {
    ivec2 size = textureSize(height_field, 0);
    ivec2 texel = ivec2(gl_VertexID % size.x, gl_VertexID / size.x);
    vec3 at = vec3((vec2(texel) + 0.5) / vec2(size), texelFetch(height_field, texel, 0).r);
    object = first + uint(gl_InstanceID);
    image = uint(FACE_TOP << FACE_SHIFT);
    gl_Position = clip_from_eye * vec4(in_origin + in_scale * rotate(in_rotation, object_from_field(at)), 1.0);
    forward = gl_Position.w;
}
