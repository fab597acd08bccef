// Computes the light of the sky that a microfacet surface reflects: the sky, blurred beforehand for each roughness, times the
// reflectance over all directions (the split sum, Karis 2013, "Real Shading in Unreal Engine 4"). Twin: reference/reflection.py.
#include "common/microfacet.glsl"
#from depthwalk.render.lighting.reflection import PARTS
uniform sampler2D mirrored_sky; // equirectangular as `sky_image`; level by level rougher (render/lighting/reflection.py)
uniform float mirrored_turn;    // radians, counter-clockwise seen from above
uniform float mirrored_intensity;
uniform float roughest;         // the level of roughness 1
uniform sampler2D reflected_parts;  // by cosine to the viewer and roughness: factor of the reflectance at normal incidence, summand

const float SQUARE_TURN = 3.14159265358979;

// direction: of any length.
vec3 mirrored_at(vec3 direction, float roughness) {
    float azimuth = atan(direction.x, direction.z == 0.0 ? 1e-9 : -direction.z);
    vec2 place = vec2(0.5 + 0.5 * (azimuth + mirrored_turn) / SQUARE_TURN, atan(length(direction.xz), direction.y) / SQUARE_TURN);
    return mirrored_intensity * textureLod(mirrored_sky, place, max(roughest + 2.0 * log2(max(roughness, 1e-3)), 0.0)).rgb;
}

// Returns the direction from which a surface reflects most, of any length: rough ones reflect more from where they face than
// mirrors do (Lagarde and de Rousiers 2014, "Moving Frostbite to PBR", §4.9.3).
vec3 lobe_direction(vec3 normal, vec3 view, float roughness) {
    float alpha = roughness * roughness;
    return mix(normal, reflect(view, normal), (1.0 - alpha) * (sqrt(1.0 - alpha) + alpha));
}

// Returns the part of even light that is reflected after several reflections between facets (Fdez-Agüera 2019, "A
// Multiple-Scattering Microfacet Model for Real-Time Image-based Lighting"). once: the part after one; rest: 1 less that of a
// surface that absorbs nothing.
vec3 reflected_often(vec3 normally, vec3 once, float rest) {
    vec3 average = normally + (1.0 - normally) / 21.0;
    return once * average / (1.0 - rest * average) * rest;
}

// Returns the light of the sky that a surface sends to the viewer. view: unit, from the viewer; from_all_sides: on a white
// surface; visibility: part of it that nothing hides.
vec3 of_sky(vec3 base, float metalness, float roughness, vec3 normal, vec3 view, vec3 from_all_sides, float visibility) {
    float facing = clamp(-dot(normal, view), 0.0, 1.0);
    vec2 scale_bias = textureLod(reflected_parts, (vec2(facing, roughness) * float(PARTS - 1) + 0.5) / float(PARTS), 0.0).xy;
    float rest = 1.0 - scale_bias.x - scale_bias.y;
    vec3 shown = base * scale_bias.x + scale_bias.y, glazed = vec3(DIELECTRIC * scale_bias.x + scale_bias.y);
    vec3 glazed_often = reflected_often(vec3(DIELECTRIC), glazed, rest);
    vec3 once = mix(glazed, shown, metalness), often = mix(glazed_often, reflected_often(base, shown, rest), metalness);
    vec3 through = base * (1.0 - metalness) * (1.0 - glazed - glazed_often);
    float seen = visibility;
#ifdef AMBIENT_OCCLUSION
    // What is hidden of a narrow lobe, from what is hidden of the hemisphere (the same, §4.10).
    seen = clamp(pow(facing + visibility, exp2(-16.0 * roughness - 1.0)) - 1.0 + visibility, 0.0, 1.0);
#endif
    return seen * once * mirrored_at(lobe_direction(normal, view, roughness), roughness) + (often + through) * from_all_sides;
}
