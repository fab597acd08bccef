// Colour and normal of a depth-image object at a point of its surface. Geometry comes from the warp; shading is looked
// up here at full resolution, whatever the grid's step was.
#include "common/meso.glsl"
uniform sampler2DArray albedo_images;   // square roots of linear colour, a = specular strength
uniform sampler2DArray normal_images;   // (xyz + 1) / 2, object frame; a = depth over the face's reach
uniform vec2 texels;                    // per metre: on the side image, on the caps
uniform float shininess;

struct Surface {
    vec3 albedo;
    float specular;
    vec3 normal;
};

// Bilinear, but by those of the four texels whose depth is that of the point: beside an edge others show another surface.
// depth and texel: over the face's reach.
void sample_border(vec3 at, float depth, float texel, out vec4 albedo, out vec3 normal) {
    ivec2 size = textureSize(normal_images, 0).xy;
    vec2 position = at.xy * vec2(size) - 0.5;
    ivec2 low = ivec2(floor(position));
    vec2 f = position - vec2(low);
    albedo = vec4(0.0);
    normal = vec3(0.0);
    float total = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(k & 1, k >> 1);
        ivec2 at_texel = low + corner;
        at_texel = ivec2((at_texel.x + size.x) % size.x, clamp(at_texel.y, 0, size.y - 1));
        vec4 stored = texelFetch(normal_images, ivec3(at_texel, int(at.z)), 0);
        vec2 near = 1.0 - abs(f - vec2(corner));
        float off = (stored.a - depth) / texel;
        float weight = (near.x * near.y + 1e-3) / (1e-3 + off * off);
        albedo += weight * texelFetch(albedo_images, ivec3(at_texel, int(at.z)), 0);
        normal += weight * (stored.xyz * 2.0 - 1.0);
        total += weight;
    }
    albedo /= total;
}

// p: object frame, metres; image: number of the image that p was warped from; footprint: metres that a pixel covers.
Surface surface_at(vec3 p, int image, float footprint) {
    bool border = (image & BORDER) != 0;
    bool past_axis = (image & PAST_AXIS) != 0;
    int layer = layer_of(image);
    bool side = on_side(image);
    Meso meso;
    if (meso_height > 0.0) meso = meso_at(p, image, footprint);
    float theta = past_axis ? atan(-p.z, -p.x) : atan(p.z, p.x);  // wraps: the sampler repeats
    vec2 uv = side ? vec2(theta / TURN, (p.y - cylinder.y) / cylinder_height) : p.xz / (2.0 * cylinder.zw) + 0.5;
    float lod = max(log2(footprint * (side ? texels.x : texels.y)), 0.0);
    vec3 at = vec3(uv, float(layer));
    vec4 albedo;
    vec3 normal;
    if (border && lod < 1.0) {
        float radial = length(p.xz);
        float top = cylinder.y + cylinder_height;
        float cap = on_top(image) ? top - p.y : p.y - cylinder.y;
        float depth = side ? cylinder.x - (past_axis ? -radial : radial) : cap;
        if (meso_height > 0.0) depth -= meso.depth;
        float reach = side ? 2.0 * cylinder.x : cylinder_height;
        sample_border(at, depth / reach, 1.0 / (reach * (side ? texels.x : texels.y)), albedo, normal);
    } else {
        albedo = textureLod(albedo_images, at, lod);
        normal = textureLod(normal_images, at, lod).xyz * 2.0 - 1.0;
    }
    normal /= max(length(normal), 1e-6);
    if (meso_height > 0.0) normal = normalize(normal + max(dot(normal, meso.outward), 0.0) * meso.gradient);
    return Surface(albedo.rgb * albedo.rgb, albedo.a, normal);
}
