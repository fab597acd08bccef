// Computes what part of the sun's light reaches each pixel's surface, in world space.
#include "common/distance.glsl"
#include "common/gbuffer.glsl"
#include "common/sun_maps.glsl"
uniform sampler2D surface_texture;

in vec2 uv;
in vec3 ray;
layout(location = 0) out float share;

void main() {
    vec3 normal = normal_from_octahedron(texture(surface_texture, uv).xy);
    share = sun_share_at(ray, distance_of(texture(depth_texture, uv).r), normal);
}
