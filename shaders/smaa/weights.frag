// Computes the part of a pixel that its neighbour across each edge takes (SMAA, §4.2 to §4.3): for the edge below, of the pixel
// above (r) and below it (g); for the edge on the left, of the pixel on its right (b) and on its left (a).
#include "smaa/line.glsl"
uniform sampler2D edge_texture;     // r: to the left of a pixel, g: below it
uniform int longest;                // most pixels for which an edge is followed, either way

layout(location = 0) out vec4 weights;

bool edge(ivec2 pixel, int channel) {
    bool inside = all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, textureSize(edge_texture, 0)));
    return inside && texelFetch(edge_texture, pixel, 0)[channel] > 0.0;
}

// Height of the line where crossing edges run from the end of an edge upward, downward, both ways or not at all.
float height(bool up, bool down) { return up == down ? 0.0 : up ? 0.5 : -0.5; }

// along: the edge's direction; channel: of the edge; above it is the pixel, below it pixel − across.
vec2 cut_along(ivec2 pixel, ivec2 along, ivec2 across, int channel) {
    if (!edge(pixel, channel)) return vec2(0.0);
    int other = 1 - channel, before = 0, after = 0;
    vec2 heights = vec2(0.0);
    for (ivec2 at = pixel; before < longest; ++before, at -= along) {
        bool up = edge(at, other), down = edge(at - across, other);
        heights.x = height(up, down);
        if (up || down || !edge(at - along, channel)) break;
    }
    for (ivec2 next = pixel + along; after < longest; ++after, next += along) {
        bool up = edge(next, other), down = edge(next - across, other);
        heights.y = height(up, down);
        if (up || down || !edge(next, channel)) break;
    }
    return areas_cut(float(before), float(after), heights);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 edges = texelFetch(edge_texture, pixel, 0).rg;
    if (edges == vec2(0.0)) discard;
    weights = vec4(cut_along(pixel, ivec2(1, 0), ivec2(0, 1), 1), cut_along(pixel, ivec2(0, 1), ivec2(1, 0), 0));
}
