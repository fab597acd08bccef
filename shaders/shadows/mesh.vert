// Projects polygons to the clip space of a shadow map; positions are relative to its centre. CUT_OUT: see map.frag.
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec3 in_position;    // asset frame, metres
in vec3 in_origin;      // of the object, world, relative to the map's centre
in vec4 in_rotation;
in float in_scale;
#ifdef CUT_OUT
in vec2 in_uv;
out vec2 uv;
#endif

void main() {
#ifdef CUT_OUT
    uv = in_uv;
#endif
    gl_Position = clip_from_eye * vec4(in_origin + in_scale * rotate(in_rotation, in_position), 1.0);
}
