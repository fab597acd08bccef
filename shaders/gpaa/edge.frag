// Blends a pixel that an edge crosses with its neighbour beyond that edge, in pixels, by the part of its area that lies beyond
// (Persson 2011; edge-optimised GPAA, §1.3, with the area in place of the distance). Twin: reference/gpaa.py.
#include "common/blending.glsl"
#include "common/distance.glsl"
#include "common/gbuffer.glsl"
#include "gpaa/line.glsl"
uniform usampler2D surface_texture;
uniform float least_fold;           // cosine of the angle below which surfaces that meet are smooth neighbours

flat in vec4 ends;
flat in float silhouette;           // 1, or 0 for a crease between faces that are both seen
layout(location = 0) out vec4 blended;

const float INFINITELY = 1e30;      // far: the sky is behind surfaces at the far plane, too
const float MAX_SLOPE = 8.0;        // faces that meet at a crease may be this many times as deep as wide

// The part of a unit square beyond a line that passes `away` ≥ 0 above its middle and rises by 0 ≤ `spread` ≤ 1 over it.
float part_beyond(float away, float spread) {
    if (away <= 0.5 - 0.5 * spread) return 0.5 - away;
    float left = max(0.5 + 0.5 * spread - away, 0.0);
    return left * left / max(2.0 * spread, 1e-6);
}

vec3 normal_at(ivec2 pixel) { return normal_of(texelFetch(surface_texture, pixel, 0).xy); }

void main() {
    Line line = line_of(ends);
    vec2 from = gl_FragCoord.xy - ends.xy;
    float away = line.steep ? line.slope * from.y - from.x : line.slope * from.x - from.y;  // of the line from the middle
    int way = away >= 0.0 ? 1 : -1;
    ivec2 here = ivec2(gl_FragCoord.xy), neighbour = here + (line.steep ? ivec2(way, 0) : ivec2(0, way));
    if (any(lessThan(neighbour, ivec2(0))) || any(greaterThanEqual(neighbour, textureSize(before_texture, 0)))) discard;

    bool inside = (ends.z - ends.x) * from.y > (ends.w - ends.y) * from.x;
    float at = distance_of(gl_FragCoord.z), farthest = behind(at, SURFACE_GAP);
    float near = distance_at(inside ? here : neighbour);
    float other = texelFetch(depth_texture, inside ? neighbour : here, 0).r;
    float far = other == 1.0 ? INFINITELY : distance_of(other);
    bool step = near <= farthest && farthest < far;
    bool level = max(near, far) <= behind(at, MAX_SLOPE) && at <= behind(min(near, far), MAX_SLOPE);
    bool crease = level && dot(normal_at(here), normal_at(neighbour)) < least_fold;
    if (!crease && !(step && silhouette > 0.0)) discard;
    blended = written(mix(pixel_before(here), pixel_before(neighbour), part_beyond(abs(away), line.spread)));
}
