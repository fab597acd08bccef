// Computes the areas that a line cuts off the pixels along an edge of pixels, in closed form; SMAA (§4.2) tabulates them.
// Twin: reference/smaa.py.
//
// The edge runs from 0 to `span`. The line is at `heights` ±½ at those ends where it continues in another row, above or below,
// at 0 at the others, and crosses the edge in the middle.

// Area between the half of the line that is at height 1 at 0 and at 0 at span/2, and the edge, from `from` to `from` + 1.
float wedge(float from, float span) {
    float start = min(from, 0.5 * span), stop = min(from + 1.0, 0.5 * span);
    return (stop - stop * stop / span) - (start - start * start / span);
}

// Areas that are cut off the pixels above and below the edge, `before` pixels after its start and `after` before its end.
vec2 areas_cut(float before, float after, vec2 heights) {
    float span = before + 1.0 + after;
    vec2 wedges = vec2(wedge(before, span), wedge(after, span));
    return vec2(dot(wedges, max(heights, 0.0)), dot(wedges, max(-heights, 0.0)));
}
