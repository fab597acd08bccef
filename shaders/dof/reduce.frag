// Reduces the picture to a quarter of its width and height: of each block the surface that covers most of it, its circle of
// confusion and its mean colour. Surfaces are not mixed, so that what is sharp does not run into what is blurred. Twin:
// reference/dof.py.
#include "dof/circle.glsl"
#from depthwalk.render.view.lens import COARSENESS
uniform sampler2D lit_texture;
layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 circles;  // of that surface; the least and the greatest of the block; pixels

void main() {
    ivec2 low = ivec2(gl_FragCoord.xy) * COARSENESS, last = textureSize(depth_texture, 0) - 1;
    float radius[COARSENESS * COARSENESS];
    float least = largest, most = -largest;
    for (int k = 0; k < COARSENESS * COARSENESS; ++k) {
        radius[k] = circle_at(min(low + ivec2(k % COARSENESS, k / COARSENESS), last));
        least = min(least, radius[k]);
        most = max(most, radius[k]);
    }
    float middle = 0.5 * (least + most), farther = 0.0;
    for (int k = 0; k < COARSENESS * COARSENESS; ++k) farther += step(middle, radius[k]);
    bool behind = 2.0 * farther > float(COARSENESS * COARSENESS);
    vec4 light = vec4(0.0);
    float own = 0.0, count = 0.0;
    for (int k = 0; k < COARSENESS * COARSENESS; ++k) {
        float weight = (radius[k] >= middle) == behind ? 1.0 : 0.0;
        light += weight * texelFetch(lit_texture, min(low + ivec2(k % COARSENESS, k / COARSENESS), last), 0);
        own += weight * radius[k];
        count += weight;
    }
    colour = light / count;
    circles = vec4(own / count, least, most, 0.0);
}
