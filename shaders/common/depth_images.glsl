// Colour and normal of a depth-image object at a point of its surface. Geometry comes from the warp; shading is looked
// up here at full resolution, whatever the grid's step was.
// MESO: the object has meso-structure.
#include "common/meso.glsl"
#include "common/pages.glsl"
uniform float texels[7];                // per metre, on each face
uniform float shininess;

struct Surface {
    vec3 albedo;
    float specular;
    vec3 normal;
};

// Bilinear, but by those of the four texels whose depth is that of the point: beside an edge others show another surface.
// at: texels of the pages; depth and texel: over the face's reach.
void sample_border(vec2 at, float depth, float texel, out vec4 albedo, out vec3 normal) {
    ivec2 low = ivec2(floor(at - 0.5));
    vec2 f = at - 0.5 - vec2(low);
    albedo = vec4(0.0);
    normal = vec3(0.0);
    float total = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(k & 1, k >> 1);
        vec4 stored = page_fetch(low + corner, NORMALS);
        vec2 near = 1.0 - abs(f - vec2(corner));
        float off = (stored.a - depth) / texel;
        float weight = (near.x * near.y + 1e-3) / (1e-3 + off * off);
        albedo += weight * page_fetch(low + corner, COLOURS);
        normal += weight * (stored.xyz * 2.0 - 1.0);
        total += weight;
    }
    albedo /= total;
}

// p: object frame, metres; image: number of the image that p was warped from; footprint: metres that a pixel covers.
Surface surface_at(vec3 p, int image, float footprint) {
    bool border = (image & (EDGE | BORDER)) != 0;
    int face = face_of(image);
#ifdef MESO
    Meso meso = meso_at(p, image, footprint);
#endif
    vec3 position = image_position(p, image);
    float lod = max(log2(footprint * texels[face]), 0.0);
    if (face == SIDE) position.x = fract(position.x);
    vec3 place = page_at(number_of(image), position.xy, lod);
    vec4 albedo;
    vec3 normal;
    if (border && lod < 1.0) {
        float depth = position.z;
#ifdef MESO
        depth -= meso.depth;
#endif
        float reach = face_reach(face);
        sample_border(place.xy, depth / reach, 1.0 / (reach * texels[face]), albedo, normal);
    } else {
        albedo = page_texel(place, COLOURS);
        normal = page_texel(place, NORMALS).xyz * 2.0 - 1.0;
    }
    normal /= max(length(normal), 1e-6);
#ifdef MESO
    normal = normalize(normal + max(dot(normal, meso.outward), 0.0) * meso.gradient);
#endif
    return Surface(albedo.rgb * albedo.rgb, albedo.a, normal);
}
