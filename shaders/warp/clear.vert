// Covers a slot of the atlas that is cleared, in clip space of the atlas, at the far plane.
uniform vec2 atlas_size;
in vec4 in_slot;    // x, y, width, height in texels

void main() {
    vec2 corner = in_slot.xy + in_slot.zw * vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(2.0 * corner / atlas_size - 1.0, 1.0, 1.0);
}
