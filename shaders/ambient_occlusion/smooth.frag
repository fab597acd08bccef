// Averages the ambient visibility over 4 × 4 texels of the same surface, in which planes and steps take all their turns.
#include "ambient_occlusion/neighbour.glsl"
#include "common/gbuffer.glsl"
uniform usampler2D surface_texture;

layout(location = 0) out vec2 visibility;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy), pixel = shown_pixel(texel);
    visibility = texelFetch(ambient_visibility, texel, 0).xy;
    if (texelFetch(depth_texture, pixel, 0).r == 1.0) return;
    vec3 point = seen_point(pixel, visibility.y), normal = normal_of(texelFetch(surface_texture, pixel, 0).xy);
    vec2 total = vec2(0.0);
    for (int y = -2; y < 2; ++y)
        for (int x = -2; x < 2; ++x) total += weighted_visibility(texel + ivec2(x, y), point, normal);
    visibility.x = total.x / total.y;
}
