// Transforms translucent and glowing polygons, instanced, from their asset's frame to clip space.
// UNLIT: polygons that light does not change. GLOW: polygons of surfaces that are drawn already, whose depth may differ by `tolerance`.
#include "common/rotation.glsl"
#include "common/view.glsl"
#ifdef GLOW
uniform float tolerance;        // metres in the asset's frame
uniform float seen_error;       // error of surfaces in the picture, metres at one metre
#endif

in vec3 in_position;    // asset frame, metres
in vec2 in_uv;
in vec3 in_emission;    // linear
#ifndef GLOW
in vec4 in_colour;      // linear, a = opacity
#ifndef UNLIT
in vec3 in_normal;
in vec2 in_highlight;   // strength, exponent
#endif
#endif
in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

out vec3 from_viewer;   // world
out vec2 uv;
out vec3 emission;
#ifndef GLOW
out vec4 colour;
#ifndef UNLIT
out vec3 normal;
flat out vec2 highlight;
#endif
#endif

void main() {
    from_viewer = in_origin + in_scale * rotate(in_rotation, in_position);
    uv = in_uv;
    emission = in_emission;
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
#ifdef GLOW
    // The depth of a point on the same ray, nearer by that much.
    float part = max(1.0 - seen_error - tolerance * in_scale / max(length(from_viewer), 1e-6), 0.5);
    gl_Position.z = (clip_from_eye * vec4(part * from_viewer, 1.0)).z / part;
#else
    colour = in_colour;
#ifndef UNLIT
    normal = rotate(in_rotation, in_normal);
    highlight = in_highlight;
#endif
#endif
}
