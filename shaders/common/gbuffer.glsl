// Packs the surface of a pixel into the G-buffer for the lighting pass, and unpacks it; normals are in world space.
//   albedo:  RGBA8, colour as its square root (8 bits then suffice), a = specular strength
//   surface: RGBA16, xy = world normal (octahedral), z = shininess / MAX_SHININESS
#include "common/octahedron.glsl"
#from depthwalk.limits import MAX_SHININESS
const float LIT = 0.0;          // instead of the shininess: the pixel is lit already

vec4 encode_albedo(vec3 linear, float specular) { return vec4(sqrt(linear), specular); }
vec3 decode_albedo(vec4 texel) { return texel.rgb * texel.rgb; }
vec4 encode_surface(vec3 normal, float shininess) {
    return vec4(octahedron_from_normal(normal), max(shininess, 1.0) / MAX_SHININESS, 0.0);
}
