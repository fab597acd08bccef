// Writes colour and normal of the level ground into the G-buffer; world space.
#include "common/gbuffer.glsl"
#include "common/visibility.glsl"
uniform sampler2D ground_texture;
uniform vec3 colour;        // linear
uniform vec3 mean;          // of the texture, linear
uniform float tile;         // metres

in vec3 from_viewer;
in vec2 at;

layout(location = 0) out uvec2 surface;
layout(location = 1) out uvec2 visibility;

void main() {
    // Flat textures repeat visibly; a second, larger and rotated copy breaks up the pattern.
    vec2 uv = at / tile;
    vec3 near = texture(ground_texture, uv).rgb;
    vec3 far = texture(ground_texture, mat2(0.8, 0.6, -0.6, 0.8) * uv * 0.23).rgb;
    vec3 albedo = colour * near * mix(vec3(1.0), far / mean, 0.5);
    surface = packed_surface(albedo, 0.0, vec3(0.0, 1.0, 0.0), 1.0);
    visibility = GROUND;
}
