// The surface point behind a pixel of the rectangle is P = C + (X − C) / λ; its depth makes objects, meshes and
// effects meet correctly (Liu et al. 2007, §2.2: Z_t = D_t + depth).
#include "common/rotation.glsl"
#include "common/gbuffer.glsl"
#include "common/depth_images.glsl"

uniform sampler2D atlas_depth;      // 1 − nearest·λ/w, 1 where empty
uniform usampler2D atlas_owner;
uniform mat4 clip_from_eye;
uniform float pixel_angle;          // metres a pixel covers at one metre
uniform int show_tiles;             // the panel's view of the intermediate images

in vec3 ray;
in vec3 in_tile_texel;
flat in vec3 viewer;
flat in vec4 rotation;
flat in vec4 tile;
flat in vec2 scales;

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

void main() {
    ivec2 nearest;
    float scale = scales.x;
    float depth = tile_depth(tile.xy + in_tile_texel.xy / in_tile_texel.z, nearest);
    if (depth == 1.0) discard;
    float lambda = (1.0 - depth) * in_tile_texel.z / scales.y;
    vec3 from_viewer = ray / lambda;
    vec3 point = viewer + rotate_back(rotation, from_viewer) / scale;
    int image = int(texelFetch(atlas_owner, nearest, 0).r);
    Surface surface = surface_at(point, image, length(from_viewer) * pixel_angle / scale);
    vec4 clip = clip_from_eye * vec4(from_viewer, 1.0);
    gl_FragDepth = max(0.5 + 0.5 * clip.z / clip.w, gl_FragCoord.z);    // as promised, against rounding
    out_albedo = encode_albedo(surface.albedo, surface.specular);
    if (show_tiles != 0) out_albedo = encode_albedo(fract(tile.zwx * vec3(0.013, 0.029, 0.007)), 0.0);
    out_surface = encode_surface(rotate(rotation, surface.normal), shininess);
}
