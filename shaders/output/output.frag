// Linear to sRGB (IEC 61966-2-1).
uniform sampler2D lit_texture;
in vec2 uv;
layout(location = 0) out vec4 screen;

void main() {
    vec4 lit = texture(lit_texture, uv);
    vec3 c = clamp(lit.rgb, 0.0, 1.0);
    vec3 encoded = mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
    screen = vec4(encoded, lit.a);
}
