// Mixes the sharp and the blurred picture by the circle of confusion, at DISC_POINTS points of it, in linear light (Huang
// et al. 2008, §2.3). Points in front of the pixel count by their own blur, so that sharp surfaces do not bleed into those
// behind them. Twin: reference/dof_paper.py.
#include "dof/circle.glsl"
#from depthwalk.render.view.lens import DISC_POINTS
uniform sampler2D lit_texture;      // as it was
uniform sampler2D blurred_texture;
uniform vec2 disc[DISC_POINTS];     // the middle, and points of the unit disc
uniform float max_radius;           // where the blur factor is 1, pixels
layout(location = 0) out vec4 lit;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(lit_texture, 0) - 1;
    float own = circle_at(pixel), total = 0.0;
    lit = vec4(0.0);
    for (int k = 0; k < DISC_POINTS; ++k) {
        ivec2 at = clamp(pixel + ivec2(floor(abs(own) * disc[k] + 0.5)), ivec2(0), last);
        float circle = circle_at(at), blur = min(abs(circle) / max_radius, 1.0);
        float weight = circle >= own ? 1.0 : blur;
        lit += weight * mix(texelFetch(lit_texture, at, 0), texelFetch(blurred_texture, at, 0), blur);
        total += weight;
    }
    lit /= total;
}
