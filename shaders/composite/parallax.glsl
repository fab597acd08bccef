// Finds the texel of an impostor tile where the present ray meets the surface, though the tile was warped for a viewer who
// stood elsewhere: λ is looked for along the ray, see composite.vert (an inverse 2-D warp; the paper warps each frame).
// STEPS: of the search. Twin: reference/impostor_tile.py.
#include "common/per_sample.glsl"
#include "composite/tile_texels.glsl"

PER_SAMPLE in vec3 texel_near;      // homogeneous, of x and of x(∞)
PER_SAMPLE in vec3 texel_far;
flat in float nearest;              // the least w / λ of the tile
flat in vec3 parallax;              // r; λ in the middle of the object; 1 where the viewer moved

// Homogeneous texel, from the tile's corner. A step takes λ from where the last one led.
vec3 surface_texel() {
    vec3 at = mix(texel_far, texel_near, parallax.y);
    if (parallax.z > 0.0) for (int k = 0; k < STEPS; ++k) {
        ivec2 texel = ivec2(tile.xy + clamp(at.xy / at.z, vec2(0.0), tile.zw - 1.0));
        float stored = texel_at(atlas_depth, texel).r;
        if (stored < 1.0) at = mix(texel_far, texel_near, (1.0 - stored) * at.z / nearest);
    }
    return at;
}

// 1 over the distance along the present ray, of the surface with `stored` depth at the homogeneous texel `at`.
float inverse_on_ray(float stored, vec3 at) {
    float lambda = (1.0 - stored) * at.z / nearest;
    return gl_FragCoord.w / (1.0 + parallax.x * (1.0 / lambda - 1.0));      // of X on the plane it is gl_FragCoord.w
}
