// Depth samples as vertices: 16-bit positions within a box.
uniform vec3 box_low;   // object frame, metres
uniform vec3 box_size;

vec3 sample_position(uvec4 texel) { return box_low + vec3(texel.xyz) * (box_size / 65535.0); }
