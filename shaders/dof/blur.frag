// Blurs the picture in one direction of the separable Gaussian, in linear light (Huang et al. 2008, formula 5). Twin:
// reference/dof_paper.py.
#from depthwalk.render.view.lens import GAUSSIAN_RADIUS
uniform sampler2D picture;
uniform ivec2 along;            // from one tap to the next
uniform float weights[GAUSSIAN_RADIUS + 1];  // by the number of taps from the middle; the whole has a sum of 1
layout(location = 0) out vec4 blurred;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(picture, 0) - 1;
    blurred = vec4(0.0);
    for (int k = -GAUSSIAN_RADIUS; k <= GAUSSIAN_RADIUS; ++k)
        blurred += weights[abs(k)] * texelFetch(picture, clamp(pixel + k * along, ivec2(0), last), 0);
}
