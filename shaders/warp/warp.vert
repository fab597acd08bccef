// Pass 1: every depth sample moves within a plane that touches the object, toward the epipole (the viewer's foot).
// Liu, Liu and Wu 2007, §2.2 and §3.2:  X = e + (1 − Table(depth))·(S − e),  1 − Table = λ = D_t / (D_t + depth).
#include "common/samples.glsl"

in uvec4 in_sample;      // position within the box, number of the image

in vec4 in_right;       // plane axes, object frame; w: the epipole in them
in vec4 in_up;
in vec4 in_normal;      // toward the viewer; w: plane · normal
in vec4 in_to_clip;     // scale and offset from plane coordinates, relative to the epipole, to the tile in the atlas
in vec4 in_bounds;      // of the tile: a near object's samples reach beyond what the camera sees of it
in float in_distance;   // D_t, of the viewer to the plane

flat out uint image;
out float gl_ClipDistance[4];

void main() {
    vec3 sample_point = sample_position(in_sample);
    float depth = in_normal.w - dot(in_normal.xyz, sample_point);   // behind the plane
    float lambda = in_distance / (in_distance + depth);
    vec2 from_epipole = vec2(dot(in_right.xyz, sample_point) - in_right.w, dot(in_up.xyz, sample_point) - in_up.w);
    vec2 warped = lambda * from_epipole;
    // Stored depth is 1 − λ: affine over the plane for a flat triangle, nearest is smallest.
    gl_Position = vec4(warped * in_to_clip.xy + in_to_clip.zw, 1.0 - 2.0 * lambda, 1.0);
    gl_ClipDistance[0] = gl_Position.x - in_bounds.x;
    gl_ClipDistance[1] = gl_Position.y - in_bounds.y;
    gl_ClipDistance[2] = in_bounds.z - gl_Position.x;
    gl_ClipDistance[3] = in_bounds.w - gl_Position.y;
    image = in_sample.w;
}
