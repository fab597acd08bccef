// Unfolds vectors, of any length, to points of a square, 0 to 1, and back to unit vectors: Meyer et al. 2010, "On Floating-Point
// Normal Vectors". The pole in the middle of the square is +z, and stands for the vector 0 too.
vec2 octahedron_from_normal(vec3 n) {
    vec2 p = n.xy / max(abs(n.x) + abs(n.y) + abs(n.z), 1e-30);
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    return (n.z < 0.0 ? folded : p) * 0.5 + 0.5;
}

vec3 normal_from_octahedron(vec2 encoded) {
    vec2 p = encoded * 2.0 - 1.0;
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float fold = max(-n.z, 0.0);
    n.xy += vec2(n.x < 0.0 ? fold : -fold, n.y < 0.0 ? fold : -fold);
    return normalize(n);
}
