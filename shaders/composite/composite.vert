// Draws one octagon per impostor tile, the part of the plane that the tile covers less its empty corners, from the object frame
// to clip space (Liu, Liu and Wu 2007, §2.5).
//
// The tile may have been warped for a viewer C0 who was not where the present one, C, is. Where C looks at x on the plane
// (from the epipole of C0, D0 away; C is D away and off by δ), the surface at λ shows that C0 has, with r = D0 / D, at
//   λ·x + (1 − λ)·r·(x − δ):
// between x itself and x(∞) = r·(x − δ), what C sees at infinity in that direction. So the tile's texel is linear in λ too
// (docs/algorithms.md, tile cache). What C0 has at x with the depth λ, C has at (x + (1 − λ)·r·δ) / (λ + (1 − λ)·r): outlines
// are scaled and shifted, and reach farthest in any direction at the least or the greatest λ.
#include "common/per_sample.glsl"
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec4 in_right;               // plane axes, object frame; w: low corner of the rectangle
in vec4 in_up;
in vec4 in_normal;              // toward the viewer; w: D0
in vec4 in_high;                // high corner of the rectangle; λ of the object's nearest and farthest points
in vec4 in_diagonals;           // least and greatest s + v and s − v of the outline, on the plane
in vec4 in_origin;              // C0, object frame; the tile's least w / λ
in vec3 in_to_x;                // homography from plane coordinates, relative to the epipole, to texels from the tile's corner
in vec3 in_to_y;
in vec3 in_to_w;
in vec4 in_tile;                // x, y, width, height in texels
in vec4 in_viewer;              // C, object frame; the object's scale
in vec4 in_rotation;
in vec2 in_pixel;               // of the picture, where the tile's corner lies, if its texels are the pixels
in vec2 in_objects;             // number of its first object in the occlusion phase; how many it shows

uniform uint first;             // number of the first object of the occlusion phase

flat out uint object;           // number of the first that the tile shows
flat out uint objects;
flat out vec4 tile;
#ifdef ALIGNED
flat out ivec2 texel_from_pixel;
flat out float nearest_distance;    // metres along the view axis, of what is stored as 0
#else
PER_SAMPLE out vec3 texel_near;            // homogeneous, of x and of x(∞)
PER_SAMPLE out vec3 texel_far;
flat out float nearest;         // the least w / λ of the tile
flat out vec3 parallax;         // r; λ in the middle of the object; 1 where C is not C0
#endif

// Where C sees what C0 has at `position`, if its λ is `lambda`.
vec4 shifted(vec4 position, float lambda, float ratio, vec4 delta) {
    return (position + (1.0 - lambda) * ratio * delta) / (lambda + (1.0 - lambda) * ratio);
}

// Corner of an octagon: left and right ones in turn, from the lower edge to the upper. low, high: of the rectangle around it;
// ends: least and greatest x + y and x − y.
vec2 octagon_corner(vec2 low, vec2 high, vec4 ends) {
    bool right = (gl_VertexID & 1) == 1;
    int height = gl_VertexID >> 1;
    float y = height < 2 ? low.y : high.y;
    if (height == 0) return vec2(right ? min(high.x, ends.w + y) : max(low.x, ends.x - y), y);
    if (height == 3) return vec2(right ? min(high.x, ends.y - y) : max(low.x, ends.z + y), y);
    float x = right ? high.x : low.x;
    if (height == 1) return vec2(x, max(y, right ? x - ends.w : ends.x - x));
    return vec2(x, min(y, right ? ends.y - x : x - ends.z));
}

void main() {
    vec3 moved = in_viewer.xyz - in_origin.xyz;
    vec2 delta = vec2(dot(in_right.xyz, moved), dot(in_up.xyz, moved));
    float plane_distance = in_normal.w + dot(in_normal.xyz, moved);
    float ratio = in_normal.w / plane_distance;
    vec4 sides = vec4(in_right.w, in_up.w, in_high.xy);
    vec4 near = shifted(sides, in_high.z, ratio, delta.xyxy), far = shifted(sides, in_high.w, ratio, delta.xyxy);
    vec4 along = vec2(delta.x + delta.y, delta.x - delta.y).xxyy;
    vec4 near_ends = shifted(in_diagonals, in_high.z, ratio, along);
    vec4 far_ends = shifted(in_diagonals, in_high.w, ratio, along);
    vec4 ends = vec4(min(near_ends.xz, far_ends.xz), max(near_ends.yw, far_ends.yw)).xzyw;
    vec2 place = octagon_corner(min(near.xy, far.xy), max(near.zw, far.zw), ends);

    vec3 direction = in_right.xyz * (place.x - delta.x) + in_up.xyz * (place.y - delta.y) - in_normal.xyz * plane_distance;
    vec3 to_plane = rotate(in_rotation, direction) * in_viewer.w;
    gl_Position = clip_from_eye * vec4(to_plane, 1.0);
    object = first + uint(in_objects.x);
    objects = uint(in_objects.y);
    tile = in_tile;
#ifdef ALIGNED
    texel_from_pixel = ivec2(in_tile.xy - in_pixel);
    nearest_distance = in_origin.w * in_viewer.w;
#else
    mat3 texel_from_plane = transpose(mat3(in_to_x, in_to_y, in_to_w));
    texel_near = texel_from_plane * vec3(place, 1.0);
    texel_far = texel_from_plane * vec3(ratio * (place - delta), 1.0);
    nearest = in_origin.w;
    parallax = vec3(ratio, 0.5 * (in_high.z + in_high.w), dot(moved, moved) > 0.0);
#endif
}
