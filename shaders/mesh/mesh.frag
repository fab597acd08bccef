// Writes colour and world normal of polygons into the G-buffer.
// PAINTED: vertices have colours, or the material has a texture. CUT_OUT: there is no surface where its alpha is low.
#include "common/gbuffer.glsl"
#include "common/visibility.glsl"
uniform sampler2D base_texture;
uniform vec3 base_colour;   // linear
uniform float specular;
uniform float shininess;
#ifdef CUT_OUT
uniform float cutoff;       // alpha
#endif

centroid in vec3 normal;
#ifdef PAINTED
centroid in vec3 colour;
centroid in vec2 uv;
#endif

layout(location = 0) out uvec2 surface;
layout(location = 1) out uvec2 visibility;

void main() {
    vec3 albedo = base_colour;
#ifdef PAINTED
    vec4 texel = texture(base_texture, uv);
    albedo *= colour * texel.rgb;
#endif
#ifdef CUT_OUT
    if (texel.a < cutoff) discard;
#endif
    // An open mesh shows its inside; it is lit as two-sided.
    vec3 facing = gl_FrontFacing ? normal : -normal;
    surface = packed_surface(albedo, specular, facing, shininess);
    visibility = NO_OBJECT;
}
