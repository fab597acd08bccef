// Places the samples of a view on the unrolled cylinder, in clip space of the side image.
uniform float far_depth;  // 2R, metres
uniform bool wraps;       // these triangles cross the seam: the part after it continues beyond the right edge …
uniform vec2 shift;       // … and is drawn once more, one turn to the left

in vec3 in_place;    // u, v in [0, 1], depth in metres
in vec3 in_normal;   // object frame, turned toward the view
in vec4 in_albedo;   // linear RGB, specular
in vec4 in_facing;   // the face's own normal; ±1, negative where the view sees its back

out float depth;
out vec3 normal;
out vec4 albedo;
out vec4 facing;

void main() {
    vec2 place = in_place.xy + shift;
    if (wraps && in_place.x < 0.5) place.x += 1.0;
    depth = in_place.z;
    normal = in_normal;
    albedo = in_albedo;
    facing = in_facing;
    gl_Position = vec4(2.0 * place - 1.0, 2.0 * depth / far_depth - 1.0, 1.0);
}
