// Turns normals as a tangent-space normal map says. The frame comes from derivatives along the screen (Schüler 2013,
// "Followup: Normal Mapping Without Precomputed Tangents"), so vertices need no tangents. Twin: reference/normal_map.py.
uniform sampler2D normal_map;
uniform float normal_scale;     // factor on x and y of its normals

// normal: interpolated, any length; place: position, in the frame of the normal; uv: its texture coordinates, extrapolated
// as `place` is, so that their derivatives belong together; sampled: those to look up.
vec3 mapped_normal(vec3 normal, vec3 place, vec2 uv, vec2 sampled) {
    vec3 n = normalize(normal), across_x = dFdx(place), across_y = dFdy(place);
    vec2 uv_x = dFdx(uv), uv_y = dFdy(uv);
    vec3 texel = texture(normal_map, sampled).xyz * 2.0 - 1.0;
    texel.xy *= normal_scale;
    float mirrored = sign(uv_x.x * uv_y.y - uv_x.y * uv_y.x);
    vec3 tangent = mirrored * (across_x * uv_y.y - across_y * uv_x.y);
    tangent -= n * dot(n, tangent);
    float square = dot(tangent, tangent);
    if (mirrored == 0.0 || square <= 1e-30) return n;
    tangent *= inversesqrt(square);
    vec3 bitangent = mirrored * sign(dot(n, cross(across_x, across_y))) * cross(n, tangent);
    vec3 turned = texel.x * tangent + texel.y * bitangent + texel.z * n;
    float length2 = dot(turned, turned);
    return length2 > 0.0 ? turned * inversesqrt(length2) : n;
}
