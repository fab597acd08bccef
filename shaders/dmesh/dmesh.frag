#include "common/visible.glsl"

flat in uint object;
flat in uint image;

layout(location = 0) out uvec2 visible;

void main() { visible = visible_from(object, image, gl_FragCoord.w, 0.0); }
