// Colour and normal of a depth-image object at a point of its surface. Geometry comes from the warp; shading is looked
// up here at full resolution, whatever the grid's step was.
uniform sampler2DArray albedo_images;   // square roots of linear colour, a = specular strength
uniform sampler2DArray normal_images;   // xyz, object frame
uniform vec4 cylinder;                  // radius, bottom, half width, half depth
uniform float cylinder_height;
uniform vec2 texels;                    // per metre: on the side image, on the caps
uniform ivec2 first_images;             // number of the first side image and of the first bottom image
uniform float shininess;

const int PAST_AXIS = 256;
const float TURN = 6.283185307179586;

struct Surface {
    vec3 albedo;
    float specular;
    vec3 normal;
};

// p: object frame, metres; image: number of the image that p was warped from; footprint: metres that a pixel covers.
Surface surface_at(vec3 p, int image, float footprint) {
    bool past_axis = image >= PAST_AXIS;
    int layer = past_axis ? image - PAST_AXIS : image;
    bool side = layer >= first_images.x && layer < first_images.y;
    float theta = past_axis ? atan(-p.z, -p.x) : atan(p.z, p.x);  // wraps: the sampler repeats
    vec2 uv = side ? vec2(theta / TURN, (p.y - cylinder.y) / cylinder_height) : p.xz / (2.0 * cylinder.zw) + 0.5;
    float lod = max(log2(footprint * (side ? texels.x : texels.y)), 0.0);
    vec3 at = vec3(uv, float(layer));
    vec4 albedo = textureLod(albedo_images, at, lod);
    vec3 normal = textureLod(normal_images, at, lod).xyz;
    return Surface(albedo.rgb * albedo.rgb, albedo.a, normal / max(length(normal), 1e-6));
}
