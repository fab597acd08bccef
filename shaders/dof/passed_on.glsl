// Passes light on to the pixel passes that share the program: DRAW_PASSES calls them, RESULT is what the last one draws.
// Without DRAW_PASSES the light itself is drawn.
layout(location = 0) out vec4 result;

vec4 passed_on(vec4 light) {
#ifdef DRAW_PASSES
    Pixel pixel;
    pixel.lit = light;
    DRAW_PASSES
    return RESULT;
#else
    return light;
#endif
}
