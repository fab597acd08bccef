// Depth samples as vertices: 16-bit positions within a box.
uniform vec3 box_low;   // object frame, metres
uniform vec3 box_size;

// The last component: number of the image with its flags, and what part of the meso-structure's depth applies.
uint sample_image(uvec4 texel) { return texel.w & 1023u; }
float sample_ease(uvec4 texel) { return float(texel.w >> 10) / 63.0; }
// Metres: border vertices, guesses at where a surface goes on, give way to samples of it by other images.
uniform float setback;
float sample_setback(uvec4 texel) { return (texel.w & 512u) != 0u ? setback : 0.0; }
vec3 sample_position(uvec4 texel) { return box_low + vec3(texel.xyz) * (box_size / 65535.0); }
