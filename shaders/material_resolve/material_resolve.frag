// Looks up colour and world normal of each pixel that shows a depth-image object, once: deferred texturing of the visibility
// buffer, asset by asset as Karis et al. 2021, "Nanite: A Deep Dive", resolve it material by material.
// FORWARD: light it here too, in the object frame; SHADOWS: the sun casts shadows.
// SHOW_TILES: objects with impostor tiles are painted, each in a colour of its own.
#include "common/rotation.glsl"
#include "common/view.glsl"
#include "common/gbuffer.glsl"
#include "common/depth_images.glsl"
#include "material_resolve/objects.glsl"
#ifdef FORWARD
#include "common/phong.glsl"
#ifdef SHADOWS
#include "common/sun_maps.glsl"
#endif
layout(location = 2) out vec4 lit;
#endif

// No visible surface faces away from the viewer, but its normal may: by less than 20° where it is blended about silhouettes,
// and by any angle on simplified leaves, whose two sides are one surface that looks up either; far trees were dark. Beyond
// this cosine it is turned round. Relief keeps its normal: what is steeper than it is displaced lies in its own shadow.
const float AVERTED = 0.35;

in vec2 uv;
in vec3 ray;

layout(location = 0) out vec4 out_albedo;
layout(location = 1) out vec4 out_surface;

void main() {
    uvec2 visibility = texture(visibility_texture, uv).xy;
    vec4 viewer = object_texel(object_of(visibility), SURFACE_RECORD_VIEWER);     // w: the object's scale
    vec4 rotation = object_texel(object_of(visibility), SURFACE_RECORD_ROTATION);
    vec3 from_viewer = ray * distance_of(visibility);
    vec3 point = viewer.xyz + rotate_back(rotation, from_viewer) / viewer.w;
#ifdef COORDINATES
    sight = point - viewer.xyz;
    float reach = distance_of(visibility) / viewer.w;
    sight_right = rotate_back(rotation, ray_from_screen[0]) * (reach * 2.0 / view_size.x);
    sight_up = rotate_back(rotation, ray_from_screen[1]) * (reach * 2.0 / view_size.y);
#endif
    Surface surface = surface_at(point, image_of(visibility), length(from_viewer) * pixel_angle / viewer.w);
    vec3 view = normalize(point - viewer.xyz);
#ifndef MESO
    if (dot(surface.normal, view) > AVERTED) surface.normal = -surface.normal;
#endif
#ifdef SHOW_TILES
    if (object_texel(object_of(visibility), SURFACE_RECORD_MATERIAL_DEPTH).y > 0.0) {
        surface.albedo = fract(float(object_of(visibility)) * vec3(0.618, 0.414, 0.732));
        surface.specular = 0.0;
    }
#endif
    out_albedo = encode_albedo(surface.albedo, surface.specular);
    vec3 normal = rotate(rotation, surface.normal);
    out_surface = encode_surface(normal, shininess);
#ifdef FORWARD
    // Liu, Liu and Wu 2007, §2.4: light, normal and viewer in the space of the texture, where the sample was warped.
    vec3 to_light = rotate_back(rotation, to_sun);
    vec3 reflected = phong(surface.albedo, surface.specular, shininess, surface.normal, view, to_light);
#ifdef SHADOWS
    reflected *= sun_share_at(ray, distance_of(visibility), normal);
#endif
    lit = vec4(surface.albedo * everywhere(normal) + sun * reflected, 1.0);
    out_surface.z = LIT;
#endif
}
