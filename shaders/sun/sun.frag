// What part of the sun's light reaches each pixel's surface.
#include "common/distance.glsl"
#include "common/gbuffer.glsl"
#include "common/sun_maps.glsl"
uniform sampler2D surface_texture;

in vec3 ray;
layout(location = 0) out float share;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 normal = normal_from_octahedron(texelFetch(surface_texture, pixel, 0).xy);
    share = sun_share_at(ray, distance_at(pixel), normal);
}
