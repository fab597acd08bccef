// Computes how much of a pixel its neighbour takes across each edge (SMAA, §4.2 to §4.3): of what is above an edge below
// (r), of what is below it (g), of what is on the right of an edge on the left (b), of what is on its left (a).
#include "smaa/line.glsl"
uniform sampler2D edge_texture;     // r: to the left of a pixel, g: below it
uniform int longest;                // pixels that an edge is followed either way

layout(location = 0) out vec4 weights;

bool edge(ivec2 pixel, int channel) {
    bool inside = all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, textureSize(edge_texture, 0)));
    return inside && texelFetch(edge_texture, pixel, 0)[channel] > 0.0;
}

// Height of the line where edges across run from the end of an edge upward, downward, both ways or not at all.
float height(bool up, bool down) { return up == down ? 0.0 : up ? 0.5 : -0.5; }

// along: the edge's way; channel: of the edge; above it is the pixel, below it pixel − across.
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
