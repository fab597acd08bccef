// Deferred Phong lighting.
#include "common/gbuffer.glsl"
uniform sampler2D albedo_texture;
uniform sampler2D surface_texture;
uniform vec3 to_sun;
uniform vec3 sun;               // linear radiance
uniform vec3 ambient;

in vec3 ray;
layout(location = 0) out vec4 lit;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 stored = texelFetch(albedo_texture, pixel, 0);
    vec4 surface = texelFetch(surface_texture, pixel, 0);
    vec3 albedo = decode_albedo(stored);
    vec3 normal = normal_from_octahedron(surface.xy);
    float lambert = max(dot(normal, to_sun), 0.0);
    // Phong 1975: the mirrored sun against the direction to the viewer.
    float mirrored = max(dot(reflect(normalize(ray), normal), to_sun), 0.0);
    float highlight = lambert > 0.0 ? stored.a * pow(mirrored, max(surface.z * MAX_SHININESS, 1.0)) : 0.0;
    // Light from everywhere is a little less from below.
    vec3 everywhere = ambient * (0.75 + 0.25 * normal.y);
    lit = vec4(albedo * (everywhere + sun * lambert) + sun * highlight, 1.0);
}
