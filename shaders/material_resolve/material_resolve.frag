// Looks up colour and world normal of each pixel that shows a depth-image object, once: deferred texturing of the visibility
// buffer, asset by asset as Karis et al. 2021, "Nanite: A Deep Dive", resolve it material by material.
// FORWARD: light it here too, in the object frame; SHADOWS: the sun casts shadows.
// LIT_TILES: objects with impostor tiles are lit already, in pass 1; SURFACE_TOO: their normals are needed all the same.
// UNLIT: the asset keeps its colour, see common/gbuffer.glsl. REFLECTS: it reflects the sky;
// TELLS_ROUGHNESS: texel by texel as its code says.
// SHOW_TILES: objects with impostor tiles are painted, each in a colour of its own.
#from depthwalk.render.lod.selection import USUAL_COSINE
#include "common/rotation.glsl"
#include "common/view.glsl"
#include "common/gbuffer.glsl"
#include "common/seen_surface.glsl"
#include "material_resolve/objects.glsl"
#ifdef FORWARD
#include "common/forward_light.glsl"
#ifdef SHADOWS
#include "common/sun_maps.glsl"
#endif
layout(location = 1) out vec4 lit;
#endif
#ifdef LIT_TILES
uniform sampler2D tile_light;
#endif

in vec2 uv;
in vec3 ray;

layout(location = 0) out uvec2 words;

void main() {
    uvec2 visibility = texture(visibility_texture, uv).xy;
#ifdef LIT_TILES
    bool tiled = object_texel(object_of(visibility), SURFACE_RECORD_MATERIAL_DEPTH).y > 0.0;
#ifndef SURFACE_TOO
    if (tiled) {
        words = lit_surface(packed_surface(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 1.0));
        lit = texture(tile_light, uv);
        return;
    }
#endif
#endif
    vec4 viewer = object_texel(object_of(visibility), SURFACE_RECORD_VIEWER);     // w: the object's scale
    vec4 rotation = object_texel(object_of(visibility), SURFACE_RECORD_ROTATION);
    vec3 seen_along = ray + mat2x3(ray_from_screen) * (aside_of(visibility) * 2.0 / view_size);
    vec3 from_viewer = seen_along * distance_of(visibility);
    vec3 point = viewer.xyz + rotate_back(rotation, from_viewer) / viewer.w;
#ifdef COORDINATES
    sight = point - viewer.xyz;
    float reach = distance_of(visibility) / viewer.w;
    sight_right = rotate_back(rotation, ray_from_screen[0]) * (reach * 2.0 / view_size.x);
    sight_up = rotate_back(rotation, ray_from_screen[1]) * (reach * 2.0 / view_size.y);
#endif
    vec3 view = normalize(point - viewer.xyz);
    // Beyond that angle the picture stretches what it shows so much that texels would be too coarse for it.
    float seen_away = min(length(from_viewer), distance_of(visibility) / USUAL_COSINE);
    Surface surface = seen_surface(point, image_of(visibility), seen_away * pixel_angle / viewer.w, view);
#ifdef SHOW_TILES
    if (object_texel(object_of(visibility), SURFACE_RECORD_MATERIAL_DEPTH).y > 0.0) {
        surface.albedo = fract(float(object_of(visibility)) * vec3(0.618, 0.414, 0.732));
        surface.specular = 0.0;
    }
#endif
    vec3 normal = rotate(rotation, surface.normal);
#if defined REFLECTS && !defined TELLS_ROUGHNESS
    words = reflecting_surface(surface.albedo, surface.specular, normal, shininess, reflection.xyz);
#else
    words = packed_surface(surface.albedo, surface.specular, normal, shininess_at(surface));
#endif
#if defined REFLECTS && defined TELLS_ROUGHNESS
    words = with_reflection(words, surface.reflection.x, surface.reflection.y);
#endif
#ifdef FORWARD
    float share = 1.0;
#ifdef SHADOWS
    share = sun_share_at(ray, distance_of(visibility), normal);
#endif
    lit = vec4(forward_light(surface, view, rotation, share), 1.0);
#if defined LIT_TILES && defined SURFACE_TOO
    if (tiled) {
        // Pass 1 knows of no shadow: what part of its light is left, colour by colour, is found here.
        vec3 unshadowed = forward_light(surface, view, rotation, 1.0);
        vec3 left = mix(vec3(1.0), lit.rgb / max(unshadowed, 1e-6), greaterThan(unshadowed, vec3(1e-6)));
        lit.rgb = left * texture(tile_light, uv).rgb;
    }
#endif
    words = lit_surface(words);
#endif
}
