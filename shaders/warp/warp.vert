// Warps every depth sample within a plane that touches the object, toward the epipole, into its impostor
// tile. From the object frame to clip space of the atlas, Liu, Liu and Wu 2007, §2.2 and §3.2:
//   X = e + (1 − Table(depth))·(S − e),  1 − Table = λ = D_t / (D_t + depth).
// Twin: reference/warp.py.
#include "common/displace.glsl"

in uvec4 in_sample;      // position within the box, number of the image

in vec4 in_right;       // plane axes, object frame; w: the epipole in them
in vec4 in_up;
in vec4 in_normal;      // toward the viewer; w: plane · normal
in vec3 in_depths;      // D_t, from the viewer to the plane; the least w / λ of the tile; a number to add to image numbers
in vec3 in_to_x;        // homography from plane coordinates, relative to the epipole, to the atlas in clip space
in vec3 in_to_y;
in vec3 in_to_w;
in vec4 in_bounds;      // of the tile in clip space: a near object's samples reach beyond the cropped tile

flat out uint image;
#ifdef LIT
in vec4 in_rotation;
out vec4 surface_point;
flat out vec3 seen_from;
flat out vec4 rotation;
#endif
out float gl_ClipDistance[4];

void main() {
    vec3 sample_point = sample_position(in_sample);
    vec3 viewer = in_right.xyz * in_right.w + in_up.xyz * in_up.w + in_normal.xyz * (in_normal.w + in_depths.x);
    sample_point = displaced(in_sample, sample_point, distance(viewer, sample_point));
    float depth = in_normal.w - dot(in_normal.xyz, sample_point);   // behind the plane
    float lambda = in_depths.x / (in_depths.x + depth);
    vec2 from_epipole = vec2(dot(in_right.xyz, sample_point) - in_right.w, dot(in_up.xyz, sample_point) - in_up.w);
    vec3 warped = vec3(lambda * from_epipole, 1.0);
    float w = dot(in_to_w, warped);
    // Stored depth is 1 − nearest·λ/w: affine over the tile for a flat triangle, nearest is smallest.
    float stored = in_depths.x / (in_depths.x + depth + sample_setback(in_sample));
    gl_Position = vec4(dot(in_to_x, warped), dot(in_to_y, warped), w - 2.0 * in_depths.y * stored, w);
    gl_ClipDistance[0] = gl_Position.x - in_bounds.x * w;
    gl_ClipDistance[1] = gl_Position.y - in_bounds.y * w;
    gl_ClipDistance[2] = in_bounds.z * w - gl_Position.x;
    gl_ClipDistance[3] = in_bounds.w * w - gl_Position.y;
    image = sample_image(in_sample) + uint(in_depths.z);
#ifdef LIT
    // λ and with it λ·P are linear over the plane, so that interpolating them is exact; P is not.
    surface_point = vec4(lambda * sample_point, lambda);
    seen_from = viewer;
    rotation = in_rotation;
#endif
}
