// Describes how a line on the screen passes the centre of a pixel, in pixels.
struct Line {
    bool steep;     // its major axis is y
    float slope;    // along the major axis
    float spread;   // of the line over a pixel's width; 0 for a line shorter than a pixel
};

Line line_of(vec4 ends) {
    vec2 along = ends.zw - ends.xy;
    bool steep = abs(along.y) > abs(along.x);
    float slope = steep ? along.x / along.y : along.y / along.x;
    return Line(steep, slope, max(abs(along.x), abs(along.y)) < 1.0 ? 0.0 : abs(slope));
}
