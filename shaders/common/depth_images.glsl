// Looks up colour and normal of a depth-image object at a point of its surface, in the object frame (Liu, Liu and Wu 2007,
// §2.4). Geometry comes from the warp; shading is looked up here at full resolution, whatever the grid's step was.
// MESO: the object has meso-structure.
#from depthwalk.cook.texel_encoding import DEPTH_PERIOD
#include "common/meso.glsl"
#include "common/pages.glsl"
uniform float texels[FACE_COUNT];                // per metre, on each face
uniform float shininess;

struct Surface {
    vec3 albedo;
    float specular;
    vec3 normal;
};

// How far `depth` is from the one stored, texels, of which the latter has the remainder (`depth_code` in Python).
float depth_off(float stored, float depth) {
    return abs(fract(stored * (255.0 / 256.0) - depth / DEPTH_PERIOD + 0.5) - 0.5) * DEPTH_PERIOD;
}

// Bilinear, but by those of the four texels whose depth is that of the point: beside an edge others show another surface,
// and this one goes on in the layer before or behind. There it is looked for where texels of its own are off.
// uv: within the image; place: there, of the pages; texel: around that, see `page_normal`; depth: in texels.
void sample_border(int image, vec2 uv, vec2 place, vec4 texel[4], float depth, out vec4 albedo, out vec3 normal) {
    const float LIKE = 1.5;     // texels
    ivec2 low = ivec2(floor(place - 0.5));
    vec2 f = place - 0.5 - vec2(low);
    ivec2 places[4] = ivec2[4](low, low + ivec2(1, 0), low + ivec2(0, 1), low + ivec2(1, 1));
    vec4 off;
    for (int k = 0; k < 4; ++k) off[k] = depth_off(texel[k].a, depth);
    if (any(greaterThan(off, vec4(LIKE)))) {
        int first = first_images[face_of(image)], own = number_of(image);
        int last = (face_of(image) < FACE_LEFT ? first_images[face_of(image) + 1] : textureSize(page_table, 0).z) - 1;
        for (int other = max(own - 1, first); other <= min(own + 1, last); ++other) {
            vec2 there;
            if (other == own || !page_stored(other, uv, there)) continue;
            low = ivec2(floor(there - 0.5));
            for (int k = 0; k < 4; ++k) {
                ivec2 place = low + ivec2(k & 1, k >> 1);
                vec4 found = texelFetch(page_normals, place, 0);
                float off_there = depth_off(found.a, depth);
                if (off_there < off[k]) {
                    off[k] = off_there;
                    places[k] = place;
                    texel[k] = found;
                }
            }
        }
    }
    // As good as bilinear up to LIKE, the depth's slope being unknown.
    vec4 far = off / LIKE;
    far *= far;
    far *= far;
    vec4 near = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    vec4 weight = (near + 1e-3) / (1.0 + far * far);
    weight /= dot(weight, vec4(1.0));
    normal = vec3(-1.0);
    for (int k = 0; k < 4; ++k) normal += weight[k] * 2.0 * texel[k].xyz;
    albedo = page_colour(places, weight);
}

// p: object frame, metres; image: number of the image that p was warped from; footprint: metres that a pixel covers.
Surface surface_at(vec3 p, int image, float footprint) {
    bool border = (image & (EDGE | BORDER)) != 0;
    int face = face_of(image);
#ifdef MESO
    float part = displaced_part(footprint);
    Meso wound = wound_at(p, footprint);
    p += wound_out(p, part * wound.depth) * wound.outward;      // where its image has it
    Meso straight = Meso(0.0, vec3(0.0), vec3(0.0));
    if (face != FACE_SIDE) straight = straight_at(p, image, footprint);
#endif
    vec3 position = image_position(p, image);
    float covered = footprint * texels[face];
    float lod = max(log2(covered) - 1.0, 0.0);      // what blends two texels averages over as many
    if (face == FACE_SIDE) position.x = fract(position.x);
    vec3 place = page_at(number_of(image), position.xy, lod);
    vec4 albedo = page_colour(place);
    vec3 normal;
    if (covered < 1.0 || border && lod == 0.0) {
        vec4 around[4];
        normal = page_normal(place.xy, around);
        // A face's own relief has eased out at borders, so depth there is what is stored.
        if (border) sample_border(image, position.xy, place.xy, around, position.z * texels[face], albedo, normal);
    } else {
        normal = page_texel(page_normals, place).xyz * 2.0 - 1.0;
    }
    normal /= max(length(normal), 1e-6);
#ifdef MESO
    normal += straight_share(normal, straight.outward, wound.outward) * straight.gradient;
    normal = normalize(normal + dot(normal, wound.outward) * wound_gradient(p, wound));
#endif
    return Surface(albedo.rgb * albedo.rgb, albedo.a, normal);
}
