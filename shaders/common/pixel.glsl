// Declares a pixel as pixel passes see it, which need no other pixel. Their functions are compiled into one program, in which
// each finds here the results of those before (render/pixel_pass.py).
#include "common/distance.glsl"
uniform usampler2D surface_texture;
uniform sampler2D shadow_texture;
uniform sampler2D lit_texture;

struct Pixel {
    vec2 uv;        // over the picture, 0 to 1
    vec3 ray;       // world, from the viewer to one metre along the view axis
    float depth;    // of the depth buffer; from here on as the targets of these names hold it
    uvec2 surface;  // common/gbuffer.glsl unpacks it
    float shadow;
    vec4 lit;
    vec4 screen;
};
