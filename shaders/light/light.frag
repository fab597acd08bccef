// Deferred Phong lighting; where nothing is, the sky or the plain background.
#include "common/gbuffer.glsl"
uniform sampler2D albedo_texture;
uniform sampler2D surface_texture;
uniform sampler2D depth_texture;
uniform mat4 eye_from_clip;     // inverse of clip_from_eye: vectors from the viewer, world
uniform vec3 to_sun;
uniform vec3 sun;               // linear radiance
uniform vec3 ambient;
uniform vec3 zenith;            // both the plain background where there is no sky
uniform vec3 horizon;
uniform int transparent;        // nothing is left where nothing is

in vec2 uv;
layout(location = 0) out vec4 lit;

vec3 sky(vec3 direction) {
    float rise = sqrt(clamp(direction.y, 0.0, 1.0));
    return mix(horizon, zenith, rise);
}

void main() {
    float depth = texture(depth_texture, uv).r;
    vec4 at = eye_from_clip * vec4(vec3(uv, depth) * 2.0 - 1.0, 1.0);
    vec3 view = normalize(at.xyz / at.w);
    if (depth == 1.0) {
        lit = transparent != 0 ? vec4(0.0) : vec4(sky(view), 1.0);
        return;
    }
    vec4 stored = texture(albedo_texture, uv);
    vec4 surface = texture(surface_texture, uv);
    vec3 albedo = decode_albedo(stored);
    vec3 normal = normal_from_octahedron(surface.xy);
    float lambert = max(dot(normal, to_sun), 0.0);
    // Phong 1975: the mirrored sun against the direction to the viewer.
    float mirrored = max(dot(reflect(view, normal), to_sun), 0.0);
    float highlight = lambert > 0.0 ? stored.a * pow(mirrored, max(surface.z * MAX_SHININESS, 1.0)) : 0.0;
    // Light from everywhere is a little less from below.
    vec3 everywhere = ambient * (0.75 + 0.25 * normal.y);
    lit = vec4(albedo * (everywhere + sun * lambert) + sun * highlight, 1.0);
}
