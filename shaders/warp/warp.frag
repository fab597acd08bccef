// Writes which image owns the tile's texel; 1 − nearest·λ/w goes to the depth buffer.
// LIT: also writes the light of its surface (Liu, Liu and Wu 2007, §2.4).
flat in uint image;
layout(location = 0) out uint owner;
#ifdef LIT
#from depthwalk.cook.lod_geometry import IMAGE_BITS
#include "common/forward_light.glsl"
#include "common/view.glsl"
in vec4 surface_point;      // times λ, object frame; λ
flat in vec3 seen_from;     // the viewer, object frame
flat in vec4 rotation;      // of the object
layout(location = 1) out vec4 light;
#endif

void main() {
    owner = image;
#ifdef LIT
    vec3 point = surface_point.xyz / surface_point.w, view = point - seen_from;
    float away = length(view);
    view /= away;
    Surface surface = seen_surface(point, int(image & ((1u << IMAGE_BITS) - 1u)), away * pixel_angle, view);
    light = vec4(forward_light(surface, view, rotation, 1.0), 1.0);
#endif
}
