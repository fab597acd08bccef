// Computes what a microfacet surface reflects, of metal or of anything else: GGX (Walter et al. 2007) of α = roughness², as glTF
// defines it. Twin: reference/reflection.py.
#from depthwalk.render.lighting.reflection import DIELECTRIC, LEAST_ROUGHNESS

// Roughness travels as a negative shininess through functions that know Phong's surfaces, too.
float shininess_from(float roughness) { return -1.0 - roughness; }
float roughness_from(float shininess) { return -1.0 - shininess; }

// Reflectance at normal incidence.
vec3 reflectance(vec3 base, float metalness) { return mix(vec3(DIELECTRIC), base, metalness); }

// Returns what a surface reflects of light of strength 1, as phong() does.
vec3 microfacet(vec3 base, float metalness, float roughness, vec3 normal, vec3 view, vec3 to_light) {
    float lambert = dot(normal, to_light), facing = max(abs(dot(normal, view)), 1e-3);
    if (lambert <= 0.0) return vec3(0.0);
    float alpha = max(roughness, LEAST_ROUGHNESS) * max(roughness, LEAST_ROUGHNESS), square = alpha * alpha;
    vec3 halfway = normalize(to_light - view);
    float cosine = dot(normal, halfway), incidence = 1.0 - clamp(dot(to_light, halfway), 0.0, 1.0);
    float spread = cosine * cosine * (square - 1.0) + 1.0;
    float masking = lambert * sqrt(facing * facing * (1.0 - square) + square)
        + facing * sqrt(lambert * lambert * (1.0 - square) + square);    // Heitz 2014
    vec3 fresnel = reflectance(base, metalness);
    float grazing = incidence * incidence;
    fresnel += (1.0 - fresnel) * (grazing * grazing * incidence);
    return lambert * ((1.0 - metalness) * base + fresnel * (square / (spread * spread) * 0.5 / masking));
}
