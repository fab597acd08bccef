// Computes the light that a surface reflects to the viewer, linear:
// albedo · max(n · l, 0) + specular · max(r · l, 0)^shininess (Phong 1975). Twin: reference/light.py.
// REFLECTIONS: a negative shininess is that of a surface which reflects as `microfacet` says.
#ifdef REFLECTIONS
#include "common/microfacet.glsl"
#endif
#from depthwalk.render.lighting.irradiance import POLYNOMIALS, UPRIGHT_POLYNOMIALS
uniform vec3 to_sun;        // world
uniform vec3 sun;           // linear, on a white surface that faces it
// Ambient light: spherical harmonics of the normal (Ramamoorthi and Hanrahan 2001). UPRIGHT: of its y only.
#ifdef UPRIGHT
uniform vec3 ambient[UPRIGHT_POLYNOMIALS];
#else
uniform vec3 ambient[POLYNOMIALS];
#endif

// Returns what a surface reflects of light of strength 1. view: from the viewer; all vectors are of unit length
// and in the same frame.
vec3 phong(vec3 albedo, float specular, float shininess, vec3 normal, vec3 view, vec3 to_light) {
#ifdef REFLECTIONS
    if (shininess < 0.0) return microfacet(albedo, specular, roughness_from(shininess), normal, view, to_light);
#endif
    float lambert = max(dot(normal, to_light), 0.0);
    float mirrored = max(dot(reflect(view, normal), to_light), 0.0);
    return albedo * lambert + (lambert > 0.0 ? specular * pow(mirrored, max(shininess, 1.0)) : 0.0);
}

// Returns the ambient light on a white surface; n: its normal, world.
vec3 everywhere(vec3 n) {
    vec3 shown = ambient[0] + n.y * ambient[1] + (3.0 * n.y * n.y - 1.0) * ambient[2];
#ifndef UPRIGHT
    shown += n.x * ambient[3] + n.z * ambient[4] + (n.x * n.x - n.z * n.z) * ambient[5];
    shown += n.x * n.y * ambient[6] + n.y * n.z * ambient[7] + n.z * n.x * ambient[8];
#endif
    return max(shown, 0.0);
}
