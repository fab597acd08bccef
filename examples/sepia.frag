// Tints the lit picture, keeping its luminance.
uniform sampler2D lit_texture;
out vec4 colour;
void main() {
    vec4 lit = texelFetch(lit_texture, ivec2(gl_FragCoord.xy), 0);
    float luminance = dot(lit.rgb, vec3(0.2126, 0.7152, 0.0722));
    colour = vec4(luminance * vec3(1.25, 0.95, 0.65), lit.a);
}
