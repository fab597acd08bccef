// Converts linear colours to sRGB (IEC 61966-2-1), and back.
// The power of 1 / 2.4 is fitted, 4e-5 off at most: two roots take software rasterisers a quarter of the time.
vec3 srgb_from_linear(vec3 c) {
    vec3 root = sqrt(c), fourth = sqrt(root);
    vec3 curve = (1.122681 - 0.335501 * fourth) * root + 0.196136 * fourth + 0.08133 * c - 0.064612;
    return mix(c * 12.92, curve, step(0.0031308, c));
}

vec3 linear_from_srgb(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
