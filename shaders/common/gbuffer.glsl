// Packs a surface into the two words of the G-buffer, and unpacks it again for lighting. Twin: reference/gbuffer.py.
//   x, from the lowest bits: square root of the linear colour (3 × 8 bits, as fine as sRGB), specular strength (8 bits).
//   y: world normal on the octahedron (2 × 12 bits, at most 0.06° off), logarithm of the shininess (8 bits; 0: lit already;
//      with the full specular strength: unlit; with another but 0: reflecting, and the strength tells roughness and metalness).
// One texture of integers costs a software rasteriser one fetch and no conversion, and a GPU 8 bytes of bandwidth per pixel.
#include "common/octahedron.glsl"
#from depthwalk.limits import MAX_SHININESS
#from depthwalk.render.target_table import NORMAL_BITS
#from depthwalk.ingest.mesh import DIELECTRIC_HIGHLIGHT
const uint NORMAL_MASK = (1u << NORMAL_BITS) - 1u, SHININESS_SHIFT = 2u * uint(NORMAL_BITS);
const float NORMAL_STEPS = float(NORMAL_MASK - 1u);     // even, so that floors and walls have exact normals
const float SHININESS_STEPS = 254.0;
const uint COLOUR_MASK = (1u << 24u) - 1u;
const float ROUGHNESS_STEPS = 49.0, METALNESS_STEPS = 4.0;  // of reflecting surfaces
const float ROUGHNESSES = ROUGHNESS_STEPS + 1.0;

// UNLIT: the surface shows its colour without light, and its highlight does not matter.
uvec2 packed_surface(vec3 linear, float specular, vec3 normal, float shininess) {
    uvec4 colour = uvec4(clamp(vec4(sqrt(linear), specular), 0.0, 1.0) * 255.0 + 0.5);
    uvec2 place = uvec2(octahedron_from_normal(normal) * NORMAL_STEPS + 0.5);
#ifdef UNLIT
    colour.a = 255u;
    uint sharp = 0u;
#else
    uint sharp = 1u + uint(SHININESS_STEPS * log2(max(shininess, 1.0)) / log2(MAX_SHININESS) + 0.5);
#endif
    return uvec2(
        colour.r | colour.g << 8 | colour.b << 16 | colour.a << 24,
        place.x | place.y << NORMAL_BITS | sharp << SHININESS_SHIFT
    );
}
// Packs a surface that reflects the sky. words: of it as a surface that does not; both 0 to 1.
uvec2 with_reflection(uvec2 words, float roughness, float metalness) {
    float code = 1.0 + floor(METALNESS_STEPS * metalness + 0.5) * ROUGHNESSES + floor(ROUGHNESS_STEPS * roughness + 0.5);
    return uvec2(words.x & COLOUR_MASK | uint(code) << 24, words.y & ((1u << SHININESS_SHIFT) - 1u));
}
// The same, of surfaces whose texels do not all say how they reflect. specular: strength of its highlight; reflection: roughness, and what `specular` tells
// about metalness by the last two: their sum, the second times `specular`, is a highlight's strength without roughness. From
// DIELECTRIC_HIGHLIGHT to 1 it stands for metalness; surfaces below half of that, as wood beside metal, reflect nothing.
uvec2 reflecting_surface(vec3 linear, float specular, vec3 normal, float shininess, vec3 reflection) {
    uvec2 words = packed_surface(linear, specular, normal, shininess);
    float strength = reflection.y + reflection.z * specular;
    if (strength < 0.5 * DIELECTRIC_HIGHLIGHT) return words;
    float metalness = clamp((strength - DIELECTRIC_HIGHLIGHT) / (1.0 - DIELECTRIC_HIGHLIGHT), 0.0, 1.0);
    return with_reflection(words, reflection.x, metalness);
}
// Marks the surface as lit already, so that deferred lighting leaves it alone.
uvec2 lit_surface(uvec2 surface) {
    return uvec2(surface.x & COLOUR_MASK, surface.y & ((1u << SHININESS_SHIFT) - 1u));
}

bool is_lit(uvec2 surface) { return surface.y >> SHININESS_SHIFT == 0u; }
bool is_unlit(uvec2 surface) { return is_lit(surface) && surface.x >> 24 == 255u; }
bool is_reflecting(uvec2 surface) { return is_lit(surface) && surface.x >> 24 != 0u && surface.x >> 24 != 255u; }
// Returns roughness and metalness.
vec2 reflection_of(uvec2 surface) {
    float code = float(surface.x >> 24) - 1.0, metalness = floor((code + 0.5) / ROUGHNESSES);
    return vec2(code - ROUGHNESSES * metalness, metalness) / vec2(ROUGHNESS_STEPS, METALNESS_STEPS);
}
vec3 albedo_of(uvec2 surface) {
    vec3 root = vec3(surface.x & 255u, surface.x >> 8 & 255u, surface.x >> 16 & 255u) / 255.0;
    return root * root;
}
float specular_of(uvec2 surface) { return float(surface.x >> 24) / 255.0; }
vec3 normal_of(uvec2 surface) {
    return normal_from_octahedron(vec2(surface.y & NORMAL_MASK, surface.y >> NORMAL_BITS & NORMAL_MASK) / NORMAL_STEPS);
}
float shininess_of(uvec2 surface) {
    return exp2((float(surface.y >> SHININESS_SHIFT) - 1.0) * (log2(MAX_SHININESS) / SHININESS_STEPS));
}
