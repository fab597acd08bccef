// Shows a part of the atlas of impostor tiles to the eye: near is bright, empty is dark blue.
uniform sampler2D atlas_depth;  // 1 − nearest·λ/w, 1 where empty
uniform vec4 part;              // what is shown: low corner and size, of the atlas; size 0 if it holds nothing
in vec2 uv;
layout(location = 0) out vec4 grey;

void main() {
    float depth = textureLod(atlas_depth, part.xy + vec2(uv.x, 1.0 - uv.y) * part.zw, 0.0).r;
    grey = depth == 1.0 || part.z == 0.0 ? vec4(0.06, 0.07, 0.10, 1.0) : vec4(vec3(1.0 - 0.85 * sqrt(depth)), 1.0);
}
