// Shows the coarse picture where all circles of confusion are wide.
#from depthwalk.render.view.lens import COARSENESS
uniform sampler2D coarse_texture;   // of `coarse`, linear filter
layout(location = 0) out vec4 lit;

void main() {
    vec2 size = float(COARSENESS) * vec2(textureSize(coarse_texture, 0));
    lit = textureLod(coarse_texture, gl_FragCoord.xy / size, 0.0);
}
