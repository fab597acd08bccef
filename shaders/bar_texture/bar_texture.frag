// Writes the owner of a pixel and its distance along the view axis, that of its place along a bar, into the visibility buffer.
#include "common/per_sample.glsl"
#include "common/view.glsl"
#include "common/visibility.glsl"

flat in uint object;
flat in uint image;
flat in vec2 inverses;
flat in vec2 slope;
flat in float extent;
noperspective PER_SAMPLE in vec2 place;

layout(location = 0) out uvec2 visibility;

void main() {
    float along = clamp(place.x, 0.0, extent);
    float inverse = mix(inverses.x, inverses.y, extent > 0.0 ? along / extent : 0.0);
    inverse += dot(slope, place - vec2(along, 0.0));
    visibility = visibility_from(object, image, inverse);
    gl_FragDepth = depth_from_inverse.x - depth_from_inverse.y * inverse;
}
