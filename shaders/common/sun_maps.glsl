// What part of the sun's light reaches each pixel's surface. Twin: reference/shadows.py.
#include "common/distance.glsl"
#include "common/gbuffer.glsl"
#include "common/shadow_map.glsl"
uniform sampler2D surface_texture;
uniform sampler2DShadow maps;   // tiles of equal size, two to a row
uniform int cascades;           // the nearest first
uniform mat3 light_from_world;  // to the right, up and away from the sun
uniform vec4 places[4];         // what takes such metres from the viewer to 0 … 1 across a map, and so in depth: offset, factor
uniform int resolution;         // texels along a tile's edge
const float DEPTH = 1.5;        // of a map, in widths; as in render/cascades.py
uniform float reach;            // distance along the view axis at which shadows end, metres

in vec3 ray;
layout(location = 0) out float share;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    share = 1.0;
    vec3 normal = light_from_world * normal_from_octahedron(texelFetch(surface_texture, pixel, 0).xy);
    float distance = distance_at(pixel);
    if (distance >= reach || normal.z >= 0.0) return;
    vec3 point = (light_from_world * ray + normal * seen_error) * distance;
    vec3 offset = normal * lift(length(normal.xy)) / float(resolution);
    float margin = map_margin(resolution);
    for (int k = 0; k < cascades; ++k) {
        vec3 at = point * places[k].w + places[k].xyz + offset;
        at.z = 0.5 + (at.z - 0.5) / DEPTH;
        // Before or behind what the map holds are others' casters: from high above, ground in line with a near slice.
        if (any(lessThan(at, vec3(vec2(margin), 0.0))) || any(greaterThan(at, vec3(vec2(1.0 - margin), 1.0)))) continue;
        float fade = clamp(10.0 * distance / reach - 9.0, 0.0, 1.0);
        share = mix(filtered(maps, vec2(k & 1, k >> 1), resolution, at), 1.0, fade);
        return;
    }
}
