// Transforms ordinary polygons, instanced, from their asset's frame to clip space. PAINTED, NORMAL_MAP, NUMBERED: see mesh.frag.
#include "common/rotation.glsl"
#include "common/srgb.glsl"
#include "common/view.glsl"

in vec3 in_position;    // asset frame, metres
in vec3 in_normal;
#ifdef PAINTED
in vec3 in_colour;      // sRGB
in vec2 in_uv;
#endif
in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

centroid out vec3 normal;
#ifdef PAINTED
centroid out vec3 colour;
centroid out vec2 uv;
#endif
#ifdef NORMAL_MAP
out vec3 place;
out vec2 place_uv;
#endif
#ifdef NUMBERED
uniform int first_number;   // of the first record of the draw call, among those of the frame
flat out uint number;
#endif

void main() {
    vec3 from_viewer = in_origin + in_scale * rotate(in_rotation, in_position);
    normal = rotate(in_rotation, in_normal);
#ifdef PAINTED
    colour = linear_from_srgb(in_colour);
    uv = in_uv;
#endif
#ifdef NORMAL_MAP
    place = from_viewer;
    place_uv = in_uv;
#endif
#ifdef NUMBERED
    number = uint(first_number + gl_InstanceID);
#endif
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
}
