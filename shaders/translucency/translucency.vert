// Takes translucent and glowing polygons, instanced, from their asset's frame to clip space.
// GLOW: of surfaces that are drawn already, from which they may be off as far as `tolerance` says.
#include "common/rotation.glsl"
#include "common/view.glsl"
#ifdef GLOW
uniform float tolerance;        // metres in the asset's frame
uniform float seen_error;       // metres at one metre by which what the picture shows may be off
#endif

in vec3 in_position;    // asset frame, metres
in vec3 in_normal;
in vec2 in_uv;
in vec4 in_colour;      // linear, a = opacity
in vec3 in_emission;    // linear
in vec2 in_highlight;   // strength, exponent
in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

out vec3 from_viewer;   // world
out vec3 normal;
out vec2 uv;
out vec4 colour;
out vec3 emission;
flat out vec2 highlight;

void main() {
    from_viewer = in_origin + in_scale * rotate(in_rotation, in_position);
    normal = rotate(in_rotation, in_normal);
    uv = in_uv;
    colour = in_colour;
    emission = in_emission;
    highlight = in_highlight;
    gl_Position = clip_from_eye * vec4(from_viewer, 1.0);
#ifdef GLOW
    // The depth of a point that much nearer on the same ray.
    float part = max(1.0 - seen_error - tolerance * in_scale / max(length(from_viewer), 1e-6), 0.5);
    gl_Position.z = (clip_from_eye * vec4(part * from_viewer, 1.0)).z / part;
#endif
}
