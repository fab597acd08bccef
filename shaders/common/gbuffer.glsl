// Packs what the lighting pass must know of a pixel into the G-buffer, and unpacks it; normals are in world space.
//   albedo:  RGBA8, colour as its square root (8 bits then suffice), a = specular strength
//   surface: RGBA16, xy = world normal (octahedral), z = shininess / MAX_SHININESS
#from depthwalk.limits import MAX_SHININESS
const float LIT = 0.0;          // in place of the shininess: the pixel is lit already

// Unit vectors as points of a square: Meyer et al. 2010, "On Floating-Point Normal Vectors".
vec2 octahedron_from_normal(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
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

vec4 encode_albedo(vec3 linear, float specular) { return vec4(sqrt(linear), specular); }
vec3 decode_albedo(vec4 texel) { return texel.rgb * texel.rgb; }
vec4 encode_surface(vec3 normal, float shininess) {
    return vec4(octahedron_from_normal(normal), max(shininess, 1.0) / MAX_SHININESS, 0.0);
}
