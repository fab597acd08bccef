// Averages each pixel over its circle of confusion, where all circles around are about equal and there is no occlusion.
// Twin: reference/dof.py.
#from depthwalk.render.view.lens import SHARP_RADIUS, RAY_DENSITY, MIN_RAYS, LINEAR_BLUR
uniform sampler2D sharp_texture;    // the picture as it was, linear filter
uniform int most_rays;
#include "dof/circle.glsl"
#include "dof/disc.glsl"
#include "dof/passed_on.glsl"

void main() {
    float own = circle_at(ivec2(gl_FragCoord.xy));
    bool sharp = abs(own) < SHARP_RADIUS;
    int count = sharp ? 1 : clamp(int(RAY_DENSITY * own * own), min(MIN_RAYS, most_rays), most_rays);
    float spread = sharp ? 0.0 : sqrt(max(own * own - LINEAR_BLUR, 0.25 * own * own));
    vec2 texel = 1.0 / vec2(textureSize(sharp_texture, 0)), middle = gl_FragCoord.xy * texel;
    vec2 towards = vec2(spread * inversesqrt(float(count)), 0.0);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < count; ++k, towards = TURN * towards)
        sum += textureLod(sharp_texture, middle + sqrt(float(k) + 0.5) * towards * texel, 0.0);
    result = passed_on(sum / float(count));
}
