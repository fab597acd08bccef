// Lights a surface where it is looked up, in the frame of its object, by sun and ambient light (Liu, Liu and Wu 2007, §2.4:
// light, normal and viewer in the space of the texture). UNLIT: it keeps its colour. Twin: reference/tile_light.py.
#include "common/rotation.glsl"
#include "common/depth_images.glsl"
#include "common/phong.glsl"
#include "common/seen_surface.glsl"
#from depthwalk.render.target_table import MOST_LIGHT

// view: unit, from the viewer; rotation: of the object; share: the part of the sun's light that reaches the surface.
vec3 forward_light(Surface surface, vec3 view, vec4 rotation, float share) {
#ifdef UNLIT
    return surface.albedo;
#else
    vec3 to_light = rotate_back(rotation, to_sun);
    vec3 reflected = phong(surface.albedo, surface.specular, shininess_at(surface), surface.normal, view, to_light) * share;
    return min(surface.albedo * everywhere(rotate(rotation, surface.normal)) + sun * reflected, MOST_LIGHT);
#endif
}
