// The surface point behind a pixel of the rectangle is P = C + (X − C) / λ, for the viewer that the tile was warped for;
// its depth makes objects, meshes and effects meet correctly (Liu et al. 2007, §2.2: Z_t = D_t + depth). Where the viewer has
// moved since, see composite.vert: λ is looked for along the present ray, P lies on that ray at the depth that λ stands for.
#include "common/rotation.glsl"
#include "common/gbuffer.glsl"
#include "common/depth_images.glsl"

uniform sampler2D atlas_depth;      // 1 − nearest·λ/w, 1 where empty
uniform usampler2D atlas_owner;
uniform mat4 clip_from_eye;
uniform float pixel_angle;          // metres a pixel covers at one metre
uniform int show_tiles;             // the panel's view of the intermediate images
uniform int steps;                  // of the search for λ, where the viewer has moved

in vec3 ray;
in vec3 texel_near;
in vec3 texel_far;
flat in vec3 viewer;
flat in vec4 rotation;
flat in vec4 tile;
flat in vec2 scales;
flat in vec3 parallax;

layout(location = 0) out vec4 out_albedo;
layout(location = 1) out vec4 out_surface;
#ifdef CONSERVATIVE_DEPTH
layout(depth_greater) out float gl_FragDepth;   // all surface lies behind the plane
#endif

// Texels are blended where they continue one surface: their λ differs by less than this many pixels' worth, i.e. the
// surface is less than 8 times as deep as wide.
const float STEEPEST = 8.0;

// An empty texel between two that are not is a crack, where one image's samples end and another's begin: what goes on
// behind it is the farther of the two. Gives its depth and moves `nearest` there, or 1 where there is no crack.
float across_crack(inout ivec2 nearest) {
    float filled = 1.0;
    ivec2 from = nearest;
    for (int axis = 0; axis < 2; ++axis) {
        ivec2 aside = axis == 0 ? ivec2(1, 0) : ivec2(0, 1);
        vec2 low = vec2(from - aside), high = vec2(from + aside);
        if (any(lessThan(low, tile.xy)) || any(greaterThanEqual(high, tile.xy + tile.zw))) continue;
        float before = texelFetch(atlas_depth, from - aside, 0).r, after = texelFetch(atlas_depth, from + aside, 0).r;
        if (max(before, after) < filled) {
            filled = max(before, after);
            nearest = before > after ? from - aside : from + aside;
        }
    }
    return filled;
}

// Stored depth at `texel`, between the four texels around it, 1 outside the silhouette, which runs where half of the
// weight is on empty texels; `nearest` is the texel that owns the result.
float tile_depth(vec2 texel, out ivec2 nearest) {
    vec2 position = clamp(texel, tile.xy + 0.5, tile.xy + tile.zw - 0.5) - 0.5;
    ivec2 low = ivec2(floor(position));
    vec2 f = position - vec2(low);
    vec4 depth;     // (0,1) (1,1) (1,0) (0,0), the order of textureGather
#ifdef TEXTURE_GATHER
    depth = textureGather(atlas_depth, (vec2(low) + 1.0) / vec2(textureSize(atlas_depth, 0)));
#else
    depth.x = texelFetch(atlas_depth, low + ivec2(0, 1), 0).r;
    depth.y = texelFetch(atlas_depth, low + ivec2(1, 1), 0).r;
    depth.z = texelFetch(atlas_depth, low + ivec2(1, 0), 0).r;
    depth.w = texelFetch(atlas_depth, low, 0).r;
#endif
    vec4 weight = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y));
    weight *= vec4(lessThan(depth, vec4(1.0)));
    nearest = low;
    if (dot(weight, vec4(1.0)) < 0.5) {
        nearest = ivec2(floor(position + 0.5));
        return across_crack(nearest);
    }
    // The heaviest that is not empty; of equals exactly one.
    vec2 left_right = vec2(max(weight.x, weight.w), max(weight.y, weight.z));
    bool right = left_right.y > left_right.x;
    bool upper = right ? weight.y > weight.z : weight.x > weight.w;
    nearest += ivec2(right, upper);
    float own = right ? (upper ? depth.y : depth.z) : (upper ? depth.x : depth.w);
    weight *= step(abs(depth - own), vec4(STEEPEST * pixel_angle * (1.0 - own)));
    return dot(weight, depth) / dot(weight, vec4(1.0));
}

// Homogeneous texel of the tile where the present ray meets the surface. A step takes λ from where the last one led.
vec3 surface_texel() {
    vec3 at = mix(texel_far, texel_near, parallax.y);
    for (int k = 0; k < steps && parallax.z > 0.0; ++k) {
        ivec2 texel = ivec2(tile.xy + clamp(at.xy / at.z, vec2(0.0), tile.zw - 1.0));
        float stored = texelFetch(atlas_depth, texel, 0).r;
        if (stored == 1.0) break;
        at = mix(texel_far, texel_near, (1.0 - stored) * at.z / scales.y);
    }
    return at;
}

void main() {
    ivec2 nearest;
    float scale = scales.x;
    vec3 at = surface_texel();
    vec2 texel = at.xy / at.z;
    if (any(lessThan(texel, vec2(-1.0))) || any(greaterThan(texel, tile.zw + 1.0))) discard;
    float depth = tile_depth(tile.xy + texel, nearest);
    if (depth == 1.0) discard;
    float lambda = (1.0 - depth) * at.z / scales.y;
    vec3 from_viewer = ray * (1.0 + parallax.x * (1.0 / lambda - 1.0));
    vec3 point = viewer + rotate_back(rotation, from_viewer) / scale;
    int image = int(texelFetch(atlas_owner, nearest, 0).r);
    Surface surface = surface_at(point, image, length(from_viewer) * pixel_angle / scale);
    vec4 clip = clip_from_eye * vec4(from_viewer, 1.0);
    gl_FragDepth = max(0.5 + 0.5 * clip.z / clip.w, gl_FragCoord.z);    // as promised, against rounding
    out_albedo = encode_albedo(surface.albedo, surface.specular);
    if (show_tiles != 0) out_albedo = encode_albedo(fract(tile.zwx * vec3(0.013, 0.029, 0.007)), 0.0);
    out_surface = encode_surface(rotate(rotation, surface.normal), shininess);
}
