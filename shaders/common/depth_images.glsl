// Looks up colour and normal of a depth-image object at a point of its surface, in the object frame (Liu, Liu and Wu 2007,
// §2.4). Geometry comes from the warp; shading is looked up here at full resolution, independent of the grid's step.
// MESO: the object has meso-structure. COORDINATES: it has a texture, see texture_coordinates.glsl. TELLS_ROUGHNESS: its texels
// tell roughness and metalness.
#from depthwalk.cook.lod_geometry import EDGE, BORDER
#from depthwalk.cook.texel_encoding import DEPTH_PERIOD
#include "common/meso.glsl"
#include "common/virtual_texture.glsl"
#ifdef COORDINATES
#include "common/texture_coordinates.glsl"
#endif
#ifdef TELLS_ROUGHNESS
#include "common/told_reflection.glsl"
#endif

const float SAME_SURFACE = 1.5;     // texels of depth

struct Surface {
    vec3 albedo;
    float specular;
    vec3 normal;
#ifdef TELLS_ROUGHNESS
    float shininess;
    vec2 reflection;    // roughness, metalness
#endif
};
#ifdef TELLS_ROUGHNESS
#define shininess_at(surface) surface.shininess
#else
#define shininess_at(surface) shininess     // of the whole object
#endif

// The number after that of a face's last image.
int end_of_images(int face) { return face < FACE_LEFT ? first_images[face + 1] : textureSize(page_table, 0).z; }

// Returns how far `depth` is from a stored depth, texels, of which only the remainder by DEPTH_PERIOD is stored (`depth_code`).
float depth_off(float stored, float depth) {
    return abs(fract(stored * (255.0 / 256.0) - depth / DEPTH_PERIOD + 0.5) - 0.5) * DEPTH_PERIOD;
}

// Returns how far `depth` is from what four texels store, texels.
vec4 depths_off(vec4 texel[4], float depth) {
    vec4 off;
    for (int k = 0; k < 4; ++k) off[k] = depth_off(texel[k].a, depth);
    return off;
}

// Blends those of the four texels around a point that show its surface, judged by their depths. Beside an edge the others show
// another surface, and this one continues in another layer, so all are searched; or in none of them, as a leaf between leaves,
// and would take the colour of what lies behind. So the face at which the viewer looks is searched too, since he sees the point.
// p: the point, object frame, metres; view: unit, from the viewer to it; uv: within the image; depth: of the point, texels; off:
// how far it is from those stored; around: the four texels, which are replaced by those that show the surface. Returns its normal.
vec3 sample_border(vec3 p, vec3 view, int image, vec2 uv, vec4 off, float depth, inout Around around) {
    // Another image must be within this many texels to show the same surface. Where no layer shows it, as beyond the part that a
    // face owns, its nearest texel is stored with a depth half a period off: any other surface would be nearer than that.
    const float FARTHEST = 4.0;
    if (any(greaterThan(off, vec4(SAME_SURFACE)))) {
        int face = face_of(image), own = number_of(image), end = end_of_images(face), seen = face_seen_along(view);
        // Looked up in the turn of the own image, which is known, as a turn of the loop costs more than what it looks up.
        int instead = seen == face || first_images[seen] == end_of_images(seen) ? own : first_images[seen];
        vec3 there = flat_position(p, seen) * vec3(1.0, 1.0, texels[seen]);
        // What changes in the loop goes through memory on software rasterisers. So normals are looked up after it.
        for (int turn = first_images[face]; turn < end; ++turn) {
            int other = turn == own ? instead : turn;
            vec3 position = turn == own ? there : vec3(uv, depth);
            vec2 other_place;
            if (other == own || !page_stored(other, position.xy, other_place)) continue;
            ivec2 low = ivec2(floor(other_place - 0.5));
            for (int k = 0; k < 4; ++k) {
                ivec2 place = low + ivec2(k & 1, k >> 1);
                float found_off = depth_off(texelFetch(page_normals, place, 0).a, position.z);
                if (found_off < min(off[k], FARTHEST)) {
                    off[k] = found_off;
                    around.at[k] = place;
                }
            }
        }
    }
    // Nearly bilinear up to that difference, as the slope of the depth is unknown.
    vec4 far = off / SAME_SURFACE;
    far *= far;
    far *= far;
    around.weight = (around.weight + 1e-3) / (1.0 + far * far);
    around.weight /= dot(around.weight, vec4(1.0));
    vec3 normal = vec3(-1.0);
    for (int k = 0; k < 4; ++k) normal += around.weight[k] * 2.0 * texelFetch(page_normals, around.at[k], 0).xyz;
    return normal;
}

// Returns the surface at a point. p: object frame, metres; image: the one that p was warped from, with its flags; footprint:
// metres that a pixel covers; view: unit, from the viewer to p.
Surface surface_at(vec3 p, int image, float footprint, vec3 view) {
    bool border = (image & (EDGE | BORDER)) != 0 && page_detail == 0;
    int face = face_of(image);
#ifdef MESO
    float part = displaced_part(footprint);
    Meso wound = wound_at(p, footprint);
    p += wound_out(p, part * wound.depth) * wound.outward;      // undisplaced, as in its image
    Meso straight = Meso(0.0, vec3(0.0), vec3(0.0));
    if (face != FACE_SIDE) straight = straight_at(p, image, footprint);
#endif
    vec3 position = image_position(p, image);
    float covered = footprint * texels[face];
    float lod = max(log2(covered) - 1.0, 0.0);      // bilinear filtering averages over two texels already
    if (face == FACE_SIDE) position.x = fract(position.x);
    int tier;
    vec3 place = page_at(number_of(image), position.xy, lod, tier);
    vec4 albedo;
    Around around = texels_around(place.xy);
    border = border && lod < float(MIP_TIER_LEVELS) && tier == 0;   // where the finest tier serves
    vec3 normal;
    if (covered < 1.0 || border) {
        vec4 texel[4];
        normal = page_normal(place.xy, texel);
        // Relief below a face has eased out at its borders, so the depth there is the stored one.
        vec4 off = depths_off(texel, position.z * texels[face]);
        // Averaged depths are meaningless, but the texels of level 0 are not.
        border = border && (lod == 0.0 || any(greaterThan(off, vec4(SAME_SURFACE))));
        if (border) {
            normal = sample_border(p, view, image, position.xy, off, position.z * texels[face], around);
            albedo = page_colour(around);
            place.z = 0.0;
        }
    }
    if (covered >= 1.0 && !border) normal = page_texel(page_normals, place).xyz * 2.0 - 1.0;
    if (!border) albedo = page_colour(place);
    normal /= max(length(normal), 1e-6);
    vec3 colour = albedo.rgb * albedo.rgb;
#ifdef COORDINATES
    vec2 right = step_within(p, face, normal, sight_right), up = step_within(p, face, normal, sight_up);
    colour = painted(place.xy, around, colour, border, right * image_size, up * image_size, covered);
#endif
#ifdef MESO
    normal += straight_share(normal, straight.outward, wound.outward) * straight.gradient;
    normal = normalize(normal + dot(normal, wound.outward) * wound_gradient(p, wound));
#endif
#ifdef TELLS_ROUGHNESS
    vec2 reflected = border ? page_reflection(around) : page_texel(page_reflections, place).rg, shine = highlight_of(reflected);
    return Surface(colour, shine.x, normal, shine.y, reflected);
#else
    return Surface(colour, albedo.a, normal);
#endif
}
