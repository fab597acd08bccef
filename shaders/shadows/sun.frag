// What part of the sun's light reaches each pixel's surface. Twin: reference/shadows.py.
#include "common/distance.glsl"
#include "common/gbuffer.glsl"
uniform sampler2D surface_texture;
uniform sampler2DShadow maps;   // tiles of equal size, two to a row
uniform int cascades;           // the nearest first
uniform mat3 light_from_world;  // to the right, up and away from the sun
uniform vec4 places[4];         // what takes such metres from the viewer to 0 … 1 across a map and in depth: offset, factor
uniform int resolution;         // texels along a tile's edge
uniform int filter_width;       // texels
uniform float error;            // texels by which what casts shadows may be off
uniform float reach;            // distance along the view axis at which shadows end, metres

in vec3 ray;
layout(location = 0) out float share;

// The mean over the square of `filter_width` texels about a point, its rim weighted as bilinear filters do.
float filtered(vec3 at, int cascade) {
    vec2 tile = vec2(cascade & 1, cascade >> 1) * float(resolution);
    vec2 size = vec2(textureSize(maps, 0));
    float first = 0.5 * float(filter_width) - 1.0;
    float sum = 0.0;
    for (int j = 0; j < filter_width - 1; ++j)
        for (int i = 0; i < filter_width - 1; ++i) {
            vec2 texels = tile + at.xy * float(resolution) + vec2(i, j) - first;
            sum += textureLod(maps, vec3(texels / size, at.z), 0.0);
        }
    return sum / float((filter_width - 1) * (filter_width - 1));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    share = 1.0;
    vec3 normal = light_from_world * normal_from_octahedron(texelFetch(surface_texture, pixel, 0).xy);
    float distance = distance_at(pixel);
    if (distance >= reach || normal.z >= 0.0) return;
    vec3 point = light_from_world * ray * distance;
    // Over half the filter's width a plane comes nearer to the sun by that times the tangent of its slope. Moved by so much
    // times the sine along its normal, it does not shadow itself. Half a texel more is for what the picture shows, which
    // may be off as well.
    vec3 offset = normal * (0.5 * float(filter_width) * length(normal.xy) + 0.5 + error) / float(resolution);
    float margin = 0.5 * float(filter_width) / float(resolution);
    for (int k = 0; k < cascades; ++k) {
        vec3 at = point * places[k].w + places[k].xyz + offset;
        if (any(lessThan(at.xy, vec2(margin))) || any(greaterThan(at.xy, vec2(1.0 - margin)))) continue;
        float fade = clamp(10.0 * distance / reach - 9.0, 0.0, 1.0);
        share = mix(filtered(at, k), 1.0, fade);
        return;
    }
}
