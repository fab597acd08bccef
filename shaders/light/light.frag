// Lights what the G-buffer holds (Phong 1975), in world space, to linear colour: deferred lighting.
// LAMPS: lamps reach the picture; LAMP_SHADOWS: some cast shadows; SHADOWS: the sun does; FORWARD: what `material_resolve`
// has lit stays.
#include "common/gbuffer.glsl"
#include "common/phong.glsl"
#include "common/shadow.glsl"
#ifdef LAMPS
#include "common/distance.glsl"
#include "light/lamps.glsl"
#endif
uniform sampler2D albedo_texture;
uniform sampler2D surface_texture;

in vec2 uv;
in vec3 ray;
layout(location = 0) out vec4 lit;

void main() {
    vec4 stored = texture(albedo_texture, uv);
    vec4 surface = texture(surface_texture, uv);
#ifdef FORWARD
    if (surface.z == LIT) discard;
#endif
#ifdef LAMPS
    float depth = texture(depth_texture, uv).r;
    if (depth == 1.0) discard;
#endif
    vec3 albedo = decode_albedo(stored), normal = normal_from_octahedron(surface.xy), view = normalize(ray);
    float shininess = surface.z * MAX_SHININESS;
    vec3 direct = sun * sun_share(uv);
    vec3 colour = albedo * everywhere(normal) + direct * phong(albedo, stored.a, shininess, normal, view, to_sun);
#ifdef LAMPS
    float away = distance_of(depth);
    colour += of_lamps(ray * away, away, albedo, stored.a, shininess, normal, view);
#endif
    lit = vec4(colour, 1.0);
}
