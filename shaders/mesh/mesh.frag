// Writes colour and world normal of polygons into the G-buffer.
// PAINTED: vertices have colours, or the material has a texture. CUT_OUT: there is no surface where its alpha is low.
// NORMAL_MAP: the material has a normal map; always PAINTED, too. UNLIT: it keeps its colour, see common/gbuffer.glsl.
// REFLECTS: it reflects the sky. REFLECTION_MAP: as a map of roughness and metalness says; always PAINTED, too.
// NUMBERED: the visibility buffer tells the number of the record, for false colours.
#include "common/gbuffer.glsl"
#include "common/visibility.glsl"
#ifdef NORMAL_MAP
#include "common/normal_map.glsl"
#endif
#ifdef REFLECTION_MAP
#include "common/told_reflection.glsl"
#endif
uniform sampler2D base_texture;
uniform vec3 base_colour;   // linear
#ifdef REFLECTION_MAP
uniform sampler2D reflection_map;   // roughness, metalness
#else
uniform float specular;
uniform float shininess;
#ifdef REFLECTS
uniform vec3 reflection;    // see common/gbuffer.glsl
#endif
#endif
#ifdef CUT_OUT
uniform float cutoff;       // alpha
#endif

centroid in vec3 normal;
#ifdef PAINTED
centroid in vec3 colour;
centroid in vec2 uv;
#endif
#ifdef NORMAL_MAP
in vec3 place;          // world, relative to the viewer
in vec2 place_uv;       // its texture coordinates
#endif
#ifdef NUMBERED
flat in uint number;    // of the record among those of the frame
uniform uint drawn_how; // NUMBERED_MESH or NUMBERED_CLUSTERS
#endif

layout(location = 0) out uvec2 surface;
layout(location = 1) out uvec2 visibility;

void main() {
    vec3 albedo = base_colour;
#ifdef PAINTED
    vec4 texel = texture(base_texture, uv);
    albedo *= colour * texel.rgb;
#endif
#ifdef NORMAL_MAP
    vec3 shading = mapped_normal(normal, place, place_uv, uv);  // before pixels are discarded, whose neighbours it needs
#else
    vec3 shading = normal;
#endif
#ifdef REFLECTION_MAP
    vec2 told = texture(reflection_map, uv).rg;
#endif
#ifdef CUT_OUT
    if (texel.a < cutoff) discard;
#endif
    // An open mesh shows its inside; it is lit as two-sided.
    vec3 facing = gl_FrontFacing ? shading : -shading;
#if defined REFLECTION_MAP && defined REFLECTS
    surface = with_reflection(packed_surface(albedo, 0.0, facing, 1.0), told.x, told.y);
#elif defined REFLECTION_MAP
    vec2 shine = highlight_of(told);
    surface = packed_surface(albedo, shine.x, facing, shine.y);
#elif defined REFLECTS
    surface = reflecting_surface(albedo, specular, facing, shininess, reflection);
#else
    surface = packed_surface(albedo, specular, facing, shininess);
#endif
#ifdef NUMBERED
    visibility = numbered_visibility(drawn_how, number);
#else
    visibility = NO_OBJECT;
#endif
}
