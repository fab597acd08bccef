// The surface point behind a pixel of the rectangle is P = C + (X − C) / λ, for the viewer that the tile was warped for;
// its depth makes objects, meshes and effects meet correctly (Liu et al. 2007, §2.2: Z_t = D_t + depth). Where the viewer has
// moved since, see composite.vert: λ is looked for along the present ray, P lies on that ray at the depth that λ stands for.
// What is in front in the end is shaded by the pass `shade`.
//
// ALIGNED: the tile's texels are the picture's pixels. Then w is the plane's distance along the view axis, so λ/w is 1 over
// the surface's: its depth is affine in what the tile stores, and there is nothing to resample.
// STEPS: of the search for λ, where the viewer has moved. PARTIAL: texels are half a pixel wide and tell what part of it is
// covered.
#include "common/per_sample.glsl"
#include "common/visible.glsl"

uniform sampler2D atlas_depth;      // 1 − nearest·λ/w, 1 where empty
uniform usampler2D atlas_owner;
uniform vec2 depth_from_inverse;    // depth buffer = x − y / distance along the view axis
uniform float pixel_angle;          // metres a pixel covers at one metre

flat in uint object;                // the first that the tile shows
flat in uint objects;
flat in vec4 tile;

layout(location = 0) out uvec2 visible;
#ifdef CONSERVATIVE_DEPTH
layout(depth_greater) out float gl_FragDepth;   // all surface lies behind the plane
#endif

// Stored depths of the texels at `low` + (0,1) (1,1) (1,0) (0,0).
vec4 four_depths(ivec2 low) {
#ifdef TEXTURE_GATHER
    return textureGather(atlas_depth, (vec2(low) + 1.0) / vec2(textureSize(atlas_depth, 0)));
#else
    vec4 depth;
    depth.x = texelFetch(atlas_depth, low + ivec2(0, 1), 0).r;
    depth.y = texelFetch(atlas_depth, low + ivec2(1, 1), 0).r;
    depth.z = texelFetch(atlas_depth, low + ivec2(1, 0), 0).r;
    depth.w = texelFetch(atlas_depth, low, 0).r;
    return depth;
#endif
}

// Texels continue one surface where their λ differs by less than this many pixels' worth: from one to the next, it is less
// than 8 times as deep as wide.
const float STEEPEST = 8.0;

// How far the stored depths of texels that continue the one of depth `stored` may be from it.
float reach(float stored) {
    return STEEPEST * pixel_angle * (1.0 - stored);
}

// The depth that goes on between texels of two stored depths: the farther, or 1 where they do not continue one surface.
float between(float one, float other) {
    float farther = max(one, other);
    return abs(one - other) <= reach(farther) ? farther : 1.0;
}

// Empty texels between two of one surface are a crack, where one image's samples end and another's begin; between two
// surfaces they are a gap. From `low` to `high`, which are the same or, each in its row and column, beside each other; gives
// the farther depth beyond them and moves `nearest` there, or 1 where there is no crack. before, after: the four depths from
// `low` − 1 and from `high` on.
float across_crack(ivec2 low, ivec2 high, vec4 before, vec4 after, out ivec2 nearest) {
    vec2 first = vec2(low) - tile.xy, last = vec2(high) - tile.xy;
    bvec2 inside = bvec2(first.x >= 1.0 && last.x + 2.0 <= tile.z, first.y >= 1.0 && last.y + 2.0 <= tile.w);
    float across = inside.x ? between(before.x, after.z) : 1.0;
    float along = inside.y ? between(before.z, after.x) : 1.0;
    if (across <= along) nearest = before.x > after.z ? low - ivec2(1, 0) : high + ivec2(1, 0);
    else nearest = before.z > after.x ? low - ivec2(0, 1) : high + ivec2(0, 1);
    return min(across, along);
}

#ifdef ALIGNED
flat in ivec2 texel_from_pixel;
flat in float nearest_distance;

// 1 over the distance along the view axis, 0 where nothing is; `nearest` is the texel that owns it, `open` the part of the
// pixel that shows what is behind.
float inverse_distance(out ivec2 nearest, out float open) {
    open = 0.0;
    nearest = ivec2(gl_FragCoord.xy) + texel_from_pixel;
    vec4 before = four_depths(nearest - 1), after = four_depths(nearest);
    float stored = after.w;
    if (stored == 1.0 && objects == 1u) stored = across_crack(nearest, nearest, before, after, nearest);
    return (1.0 - stored) / nearest_distance;
}
#else
PER_SAMPLE in vec3 texel_near;
PER_SAMPLE in vec3 texel_far;
flat in float least;
flat in vec3 parallax;

// Stored depth at `texel`, between the four texels around it, 1 outside the silhouette, which runs where half of the
// weight is on empty texels; `nearest` is the texel that owns the result. Where PARTIAL, that of the front surface, and
// `open` is the weight on others.
float tile_depth(vec2 texel, out ivec2 nearest, out float open) {
    vec2 position = clamp(texel, tile.xy + 0.5, tile.xy + tile.zw - 0.5) - 0.5;
    ivec2 low = ivec2(floor(position));
    vec2 f = position - vec2(low);
    vec4 depth = four_depths(low);
    vec4 weight = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y));
    depth = mix(depth, vec4(1.0), equal(weight, vec4(0.0)));    // at the border these may be the texels of the tile beside
    weight *= vec4(lessThan(depth, vec4(1.0)));
    nearest = low;
    open = 0.0;
#ifdef PARTIAL
    float front = min(min(depth.x, depth.y), min(depth.z, depth.w));
    if (front == 1.0) {     // of texels half a pixel wide a crack takes two
        ivec2 high = min(low + 1, ivec2(tile.xy + tile.zw) - 1);
        return across_crack(low, high, four_depths(low - 1), four_depths(high), nearest);
    }
    weight *= step(depth - front, vec4(reach(front)));
#else
    if (dot(weight, vec4(1.0)) < 0.5) {
        if (objects > 1u) return 1.0;       // between two of them is no crack
        ivec2 here = ivec2(floor(position + 0.5));
        return across_crack(here, here, four_depths(here - 1), four_depths(here), nearest);
    }
#endif
    // The heaviest that is not empty; of equals exactly one.
    vec2 left_right = vec2(max(weight.x, weight.w), max(weight.y, weight.z));
    bool right = left_right.y > left_right.x;
    bool upper = right ? weight.y > weight.z : weight.x > weight.w;
    nearest += ivec2(right, upper);
    float own = right ? (upper ? depth.y : depth.z) : (upper ? depth.x : depth.w);
    weight *= step(abs(depth - own), vec4(reach(own)));
#ifdef PARTIAL
    open = 1.0 - dot(weight, vec4(1.0));
#endif
    return dot(weight, depth) / dot(weight, vec4(1.0));
}

// Homogeneous texel of the tile where the present ray meets the surface. A step takes λ from where the last one led.
vec3 surface_texel() {
    vec3 at = mix(texel_far, texel_near, parallax.y);
    if (parallax.z > 0.0) for (int k = 0; k < STEPS; ++k) {
        ivec2 texel = ivec2(tile.xy + clamp(at.xy / at.z, vec2(0.0), tile.zw - 1.0));
        float stored = texelFetch(atlas_depth, texel, 0).r;
        if (stored < 1.0) at = mix(texel_far, texel_near, (1.0 - stored) * at.z / least);
    }
    return at;
}

float inverse_distance(out ivec2 nearest, out float open) {
    vec3 at = surface_texel();
    vec2 texel = at.xy / at.z;
    if (any(lessThan(texel, vec2(-1.0))) || any(greaterThan(texel, tile.zw + 1.0))) return 0.0;
    float stored = tile_depth(tile.xy + texel, nearest, open);
    if (stored == 1.0) return 0.0;
    float lambda = (1.0 - stored) * at.z / least;
    return gl_FragCoord.w / (1.0 + parallax.x * (1.0 / lambda - 1.0));      // of X on the plane it is gl_FragCoord.w
}
#endif

void main() {
    ivec2 nearest;
    float open;
    float inverse = inverse_distance(nearest, open);
    if (inverse == 0.0) discard;
    uint owner = texelFetch(atlas_owner, nearest, 0).r;
    visible = visible_from(object + (owner >> IMAGE_BITS), owner & ((1u << IMAGE_BITS) - 1u), inverse, open);
    gl_FragDepth = max(depth_from_inverse.x - depth_from_inverse.y * inverse, gl_FragCoord.z);      // as promised, against rounding
}
