// Lights translucent polygons (Phong 1975) to linear light, premultiplied by their opacity, to be blended over the picture
// (Porter and Duff 1984). Twin: reference/translucency.py.
// NORMAL_MAP: the surface has a normal map. UNLIT: it keeps its colour without light.
// GLOW: adds the light that opaque polygons emit. LAMPS, LAMP_SHADOWS, SHADOWS: as in light/light.glsl. FOG: there is fog.
#include "common/phong.glsl"
#if defined SHADOWS || defined LAMP_SHADOWS
#include "common/shadow_map.glsl"
#endif
#include "common/view.glsl"
#ifdef NORMAL_MAP
#include "common/normal_map.glsl"
#endif
#ifdef LAMPS
#include "light/lamps.glsl"
#endif
#ifdef SHADOWS
#include "common/sun_maps.glsl"
#endif
#ifdef FOG
#include "fog/fog.glsl"
#endif
#from depthwalk.render.target_table import MOST_LIGHT
uniform sampler2D base_texture;
uniform sampler2D emission_texture;
#ifdef GLOW
uniform float cutoff;   // alpha below which there is no surface, and so no glow
#endif

in vec3 from_viewer;    // world
in vec2 uv;
in vec3 emission;
#ifndef GLOW
in vec4 colour;
#ifndef UNLIT
in vec3 normal;
flat in vec2 highlight;
#endif
#endif

layout(location = 0) out vec4 lit;

#ifdef UNLIT
vec3 light_from(vec3 hidden) { return hidden; }
#elif !defined GLOW
// Highlights do not depend on opacity, as light is reflected where it enters the surface.
vec3 light_from(vec3 hidden) {
#ifdef NORMAL_MAP
    vec3 shading = mapped_normal(normal, from_viewer, uv, uv);
#else
    vec3 shading = normal;
#endif
    vec3 view = normalize(from_viewer), facing = normalize(gl_FrontFacing ? shading : -shading);
    float away = 1.0 / gl_FragCoord.w;
    vec3 direct = sun;
#ifdef SHADOWS
    direct *= sun_share_at(from_viewer / away, away, facing);
#endif
    vec3 light = hidden * everywhere(facing) + direct * phong(hidden, highlight.x, highlight.y, facing, view, to_sun);
#ifdef LAMPS
    light += of_lamps(from_viewer, away, hidden, highlight.x, highlight.y, facing, view);
#endif
    return light;
}
#endif

void main() {
    vec3 own = emission * texture(emission_texture, uv).rgb;
#ifdef GLOW
    if (texture(base_texture, uv).a < cutoff) discard;
    lit = vec4(own, 0.0);
#else
    vec4 texel = texture(base_texture, uv);
    float opacity = colour.a * texel.a;
    lit = vec4(light_from(opacity * colour.rgb * texel.rgb) + opacity * own, opacity);
#endif
#ifdef FOG
    float through = through_fog(fog_along(from_viewer));
    lit.rgb = mix(lit.a * fog_towards(normalize(from_viewer)), lit.rgb, through);
#endif
    lit.rgb = min(lit.rgb, MOST_LIGHT);
}
