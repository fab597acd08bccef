// Expands an edge of a polygon, a line in pixels, to a rectangle in clip space that covers the pixels that it crosses, along its
// minor axis (Persson 2011).
#include "common/view.glsl"
#include "gpaa/line.glsl"
in vec4 in_ends;        // pixels; the surface is on the left of the way from one to the other
in vec2 in_depths;
in float in_silhouette;

flat out vec4 ends;
flat out float silhouette;

void main() {
    Line line = line_of(in_ends);
    float half_width = 0.5 + 0.5 * line.spread;
    int end = gl_VertexID & 1;
    vec2 at = end == 0 ? in_ends.xy : in_ends.zw;
    at[line.steep ? 0 : 1] += (gl_VertexID >> 1) == 0 ? -half_width : half_width;
    ends = in_ends;
    silhouette = in_silhouette;
    gl_Position = vec4(at / view_size * 2.0 - 1.0, in_depths[end] * 2.0 - 1.0, 1.0);
}
