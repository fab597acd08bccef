// Writes the owner of a pixel and its distance along the view axis into the visibility buffer.
#include "common/per_sample.glsl"
#include "common/visibility.glsl"

flat in uint object;
flat in uint image;
PER_SAMPLE in float forward;

layout(location = 0) out uvec2 visibility;

void main() { visibility = visibility_from(object, image, 1.0 / forward); }
