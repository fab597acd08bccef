// Averages each pixel over its circle of confusion, where all around are about as large and nothing hides anything.
#from depthwalk.render.view.lens import SHARP_RADIUS, RAY_DENSITY, MIN_RAYS, LINEAR_BLUR
uniform sampler2D lit_texture;      // as it was, linear filter
uniform int samples;
layout(location = 0) out vec4 lit;
#include "dof/circle.glsl"
#include "dof/disc.glsl"

void main() {
    float own = circle_at(ivec2(gl_FragCoord.xy));
    if (abs(own) < SHARP_RADIUS) discard;
    int count = clamp(int(RAY_DENSITY * own * own), min(MIN_RAYS, samples), samples);
    float spread = sqrt(max(own * own - LINEAR_BLUR, 0.25 * own * own));
    vec2 size = vec2(textureSize(lit_texture, 0));
    vec2 towards = vec2(spread * inversesqrt(float(count)), 0.0);
    lit = vec4(0.0);
    for (int k = 0; k < count; ++k, towards = TURN * towards)
        lit += textureLod(lit_texture, (gl_FragCoord.xy + sqrt(float(k) + 0.5) * towards) / size, 0.0);
    lit /= float(count);
}
