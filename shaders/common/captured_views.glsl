// Looks up captured views, and writes the surface that a view ray hits into the G-buffer, with its depth.
// REFLECTS: the object reflects the sky.
#include "common/gbuffer.glsl"
#include "common/per_sample.glsl"
#include "common/rotation.glsl"
#include "common/view.glsl"
#include "common/visibility.glsl"
uniform sampler2DArray colour_views;    // square root of the linear colour; a = coverage
uniform sampler2DArray surface_views;   // normal, object frame, 0 to 1; a = depth, 0 at the sphere's near end, 1 at its far
uniform float specular;
uniform float shininess;
#ifdef REFLECTS
uniform vec3 reflection;    // see common/gbuffer.glsl
#endif

flat in vec4 rotation;
flat in float level;
flat in uint row;

layout(location = 0) out uvec2 surface;
layout(location = 1) out uvec2 visibility;
#ifdef CONSERVATIVE_DEPTH
layout(depth_greater) out float gl_FragDepth;   // all surface lies behind the rectangle
#endif

// What one view shows at a place: coverage, colour, normal, and the height of the surface above the middle, towards the view.
struct ViewTexel {
    float coverage;
    vec3 colour;
    vec3 normal;
    float height;       // −1 to 1, where 1 is the radius of the sphere
};

float height_in(vec2 at, float layer) { return 1.0 - 2.0 * textureLod(surface_views, vec3(at * 0.5 + 0.5, layer), level).a; }

// at: −1 to 1, where 1 is the radius of the sphere. Beyond that there is nothing.
ViewTexel view_texel(vec2 at, float layer) {
    vec3 uv = vec3(at * 0.5 + 0.5, layer);
    vec4 colour = textureLod(colour_views, uv, level), surface = textureLod(surface_views, uv, level);
    float coverage = max(abs(at.x), abs(at.y)) < 1.0 ? colour.a : 0.0;
    return ViewTexel(coverage, colour.rgb, surface.rgb * 2.0 - 1.0, 1.0 - 2.0 * surface.a);
}

// Writes a surface at `part` times the rectangle's distance along the view ray. normal: object frame, of any length.
void write_surface(vec3 colour, vec3 normal, float part) {
#ifdef REFLECTS
    surface = reflecting_surface(colour * colour, specular, rotate(rotation, normal), shininess, reflection);
#else
    surface = packed_surface(colour * colour, specular, rotate(rotation, normal), shininess);
#endif
    visibility = captured_visibility(row);
    float inverse = gl_FragCoord.w / part;
    gl_FragDepth = max(depth_from_inverse.x - depth_from_inverse.y * inverse, gl_FragCoord.z);  // greater despite rounding
}
