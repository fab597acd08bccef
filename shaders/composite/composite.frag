// Reconstructs the surface behind each pixel of an impostor tile's rectangle, in view space: P = C + (X − C) / λ for the viewer
// C that the tile was warped for (Liu, Liu and Wu 2007, §2.2: Z_t = D_t + depth). True depth makes objects, meshes and effects
// meet correctly. What is in front in the end is looked up later, once per pixel. Twin: `unwarp` of reference/warp.py.
//
// ALIGNED: the tile's texels are the picture's pixels. Then w is the plane's distance along the view axis, so λ/w is 1 over
// the surface's: its depth is affine in what the tile stores, and there is nothing to resample. Else the tile is resampled:
// where the present ray meets the surface (parallax.glsl), among the texels around that (partial_coverage.glsl).
// LIT: the tile holds lit colours too.
#include "common/per_sample.glsl"
#include "common/view.glsl"
#include "common/visibility.glsl"
#include "composite/cracks.glsl"
#ifdef ALIGNED
flat in ivec2 texel_from_pixel;
flat in float nearest_distance;     // metres along the view axis, of what is stored as 0
#else
#include "composite/parallax.glsl"
#include "composite/partial_coverage.glsl"
#endif

flat in uint object;                // number of the first that the tile shows

layout(location = 0) out uvec2 visibility;
#ifdef LIT
layout(location = 1) out vec4 tile_light;
#endif
#ifdef CONSERVATIVE_DEPTH
layout(depth_greater) out float gl_FragDepth;   // all surface lies behind the plane
#endif

// 1 over the distance along the view axis, 0 where nothing is; `owner_texel` is where it is owned, `uncovered` the part of the
// pixel that shows what is behind, `aside` where in the pixel the surface has that distance, pixels from the middle.
float inverse_distance(out ivec2 owner_texel, out float uncovered, out vec2 aside) {
    aside = vec2(0.0);
#ifdef ALIGNED
    uncovered = 0.0;
    owner_texel = ivec2(gl_FragCoord.xy) + texel_from_pixel;
    float stored = texel_at(atlas_depth, owner_texel).r;
    if (stored == 1.0 && objects == 1u) stored = across_crack(owner_texel, owner_texel, owner_texel);
    return (1.0 - stored) / nearest_distance;
#else
    vec3 at = surface_texel();
    vec2 texel = at.xy / at.z;
    if (any(lessThan(texel, vec2(-1.0))) || any(greaterThan(texel, tile.zw + 1.0))) return 0.0;
    float stored = tile_depth(tile.xy + texel, owner_texel, uncovered, aside);
    return stored == 1.0 ? 0.0 : inverse_on_ray(stored, at);
#endif
}

void main() {
    ivec2 owner_texel;
    float uncovered;
    vec2 aside;
    float inverse = inverse_distance(owner_texel, uncovered, aside);
    if (inverse == 0.0) discard;
    uint owner = texel_at(atlas_owner, owner_texel).r;
    uint image = owner & ((1u << IMAGE_BITS) - 1u);
#ifdef LIT
#ifdef ALIGNED
    tile_light = texel_at(atlas_light, owner_texel);
#else
    tile_light = tile_light_found;
#endif
#endif
    visibility = visibility_from(object + (owner >> IMAGE_BITS), image, inverse, uncovered, aside);
    float depth = depth_from_inverse.x - depth_from_inverse.y * inverse;
    gl_FragDepth = max(depth, gl_FragCoord.z);      // as promised, against rounding
}
