// Shows a pre-warped image as an ordinary texture on the picture's plane, with the true depth of what it shows (Oliveira, Bishop
// and McAllister 2000).
#from depthwalk.bake.images import Face
#from depthwalk.cook.lod_geometry import FACE_SHIFT
#include "common/per_sample.glsl"
#include "common/view.glsl"
#include "common/visibility.glsl"
uniform sampler2DArray images;      // λ: distance of the plane over that of the surface, along the ray; 0 where nothing is seen

flat in uint object;
flat in int layer;
flat in ivec2 texels;
PER_SAMPLE in vec2 texel;

layout(location = 0) out uvec2 visibility;
#ifdef CONSERVATIVE_DEPTH
layout(depth_greater) out float gl_FragDepth;   // all surface lies behind the plane
#endif

float ratio_at(ivec2 at) {
    bool inside = all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, texels));
    return inside ? texelFetch(images, ivec3(at, layer), 0).r : 0.0;
}

void main() {
    ivec2 low = ivec2(floor(texel));
    vec2 part = texel - vec2(low);
    vec4 ratio = vec4(ratio_at(low), ratio_at(low + ivec2(1, 0)), ratio_at(low + ivec2(0, 1)), ratio_at(low + 1));
    vec4 weight = vec4((1.0 - part.x) * (1.0 - part.y), part.x * (1.0 - part.y), (1.0 - part.x) * part.y, part.x * part.y);
    // Bilinear, of texels with a surface; the others have no depth to blend with.
    weight *= vec4(greaterThan(ratio, vec4(0.0)));
    float covered = dot(weight, vec4(1.0));
    if (covered < 0.5) discard;
    float inverse = gl_FragCoord.w * dot(weight, ratio) / covered;
    visibility = visibility_from(object, uint(FACE_TOP << FACE_SHIFT), inverse);
    gl_FragDepth = max(depth_from_inverse.x - depth_from_inverse.y * inverse, gl_FragCoord.z);  // greater despite rounding
}
