// Lights what the G-buffer holds (Phong 1975), in world space, to linear colour: deferred lighting; draws the sky behind it.
// AMBIENT_OCCLUSION: surfaces hide each other from ambient light; LAMPS: lamps reach the picture; LAMP_SHADOWS: some cast
// shadows; SHADOWS: the sun does; FORWARD: what `material_resolve` has lit stays; UNLIT: some surfaces keep their colour;
// REFLECTIONS: some reflect the sky.
#include "common/gbuffer.glsl"
#include "common/phong.glsl"
#include "common/pixel.glsl"
// Outside LAMPS, since passes that follow in the same program need it, too.
#include "common/records.glsl"
#include "light/background.glsl"
#from depthwalk.render.target_table import MOST_LIGHT
#ifdef AMBIENT_OCCLUSION
#include "ambient_occlusion/ambient_visibility.glsl"
#endif
#ifdef LAMPS
#include "light/lamps.glsl"
#endif
#ifdef REFLECTIONS
#include "light/reflected_sky.glsl"
#endif

void draw_light(inout Pixel pixel) {
    vec3 view = normalize(pixel.ray);
#ifdef SKY
    pixel.lit = min(background_at(view, to_sun), MOST_LIGHT);
#else
#ifdef UNLIT
    if (is_unlit(pixel.surface)) {
        pixel.lit = vec4(albedo_of(pixel.surface), 1.0);
        return;
    }
#endif
#ifdef REFLECTIONS
    bool reflects = is_reflecting(pixel.surface);
#endif
#ifdef FORWARD
#ifdef REFLECTIONS
    if (!reflects)
#endif
    if (is_lit(pixel.surface)) discard;
#endif
    vec3 albedo = albedo_of(pixel.surface), normal = normal_of(pixel.surface);
    float specular = specular_of(pixel.surface), shininess = shininess_of(pixel.surface);
#ifdef REFLECTIONS
    vec2 reflection = reflection_of(pixel.surface);
    if (reflects) {
        specular = reflection.y;
        shininess = shininess_from(reflection.x);
    }
#endif
    vec3 direct = sun;
#ifdef SHADOWS
    direct *= pixel.shadow;
#endif
    vec3 from_all_sides = everywhere(normal);
#ifdef AMBIENT_OCCLUSION
    vec3 point = pixel.ray * distance_of(pixel.depth);
    float visibility = ambient_visibility_at(point, normal);
    from_all_sides *= with_reflected(visibility, albedo);
#else
    const float visibility = 1.0;
#endif
    vec3 around = albedo * from_all_sides;
#ifdef REFLECTIONS
    if (reflects) around = of_sky(albedo, reflection.y, reflection.x, normal, view, from_all_sides, visibility);
#endif
    vec3 colour = around + direct * phong(albedo, specular, shininess, normal, view, to_sun);
#ifdef LAMPS
    float away = distance_of(pixel.depth);
    colour += of_lamps(pixel.ray * away, away, albedo, specular, shininess, normal, view);
#endif
    pixel.lit = vec4(min(colour, MOST_LIGHT), 1.0);
#endif
}
