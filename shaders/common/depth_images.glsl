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

// Bilinear, but by those of the four texels whose depth is that of the point: beside an edge others show another surface,
// and this one goes on in the layer before or behind. There it is looked for where texels of its own are off.
// uv: within the image; depth and texel: over the face's reach.
void sample_border(int image, vec2 uv, float depth, float texel, out vec4 albedo, out vec3 normal) {
    const float LIKE = 1.5;     // texels
    int first = first_images[face_of(image)], own = number_of(image);
    int last = (face_of(image) < LEFT ? first_images[face_of(image) + 1] : textureSize(page_table, 0).z) - 1;
    ivec2 low = ivec2(floor(page_at(own, uv, 0.0).xy - 0.5));
    vec2 f = page_at(own, uv, 0.0).xy - 0.5 - vec2(low);
    ivec2 places[4] = ivec2[4](low, low + ivec2(1, 0), low + ivec2(0, 1), low + ivec2(1, 1));
    float scale = 1.0 / max(texel, 1.0 / 255.0);    // depths are stored in 8 bits
    vec4 off;
    for (int k = 0; k < 4; ++k) off[k] = abs(page_fetch(places[k], NORMALS).a - depth) * scale;
    for (int other = max(own - 1, first); other <= min(own + 1, last) && any(greaterThan(off, vec4(LIKE))); ++other) {
        if (other == own || !page_stored(other, uv)) continue;
        ivec2 there = ivec2(floor(page_at(other, uv, 0.0).xy - 0.5));
        for (int k = 0; k < 4; ++k) {
            ivec2 place = there + ivec2(k & 1, k >> 1);
            float off_there = abs(page_fetch(place, NORMALS).a - depth) * scale;
            if (off_there < off[k]) {
                off[k] = off_there;
                places[k] = place;
            }
        }
    }
    albedo = vec4(0.0);
    normal = vec3(0.0);
    float total = 0.0;
    for (int k = 0; k < 4; ++k) {
        vec2 near = 1.0 - abs(f - vec2(k & 1, k >> 1));
        float weight = (near.x * near.y + 1e-3) / (1e-3 + off[k] * off[k]);
        albedo += weight * page_fetch(places[k], COLOURS);
        normal += weight * (page_fetch(places[k], NORMALS).xyz * 2.0 - 1.0);
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
        sample_border(image, position.xy, depth / reach, 1.0 / (reach * texels[face]), albedo, normal);
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
