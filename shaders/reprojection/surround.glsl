// Looks up what earlier frames saw around the viewer (render/reprojection/surround.py). Twin: reference/surround.py.
//
// The map is octahedral: straight up is its middle. Positions are relative to the map's origin, metres, world.
#include "common/octahedron.glsl"
#from depthwalk.render.reprojection.surround import SURROUND_STEPS
uniform sampler2D surround;             // sRGB; alpha 0 where nothing was seen
uniform sampler2D surround_surfaces;    // xyz: where it was seen from; w: distance of the surface, metres; 0: nothing was seen
uniform vec3 surround_viewer;

vec3 direction_at(vec2 place) { return normal_from_octahedron(place).xzy; }
vec2 place_at(vec3 direction) { return octahedron_from_normal(direction.xzy); }

vec4 surface_at(vec2 place) {
    ivec2 size = textureSize(surround_surfaces, 0);
    return texelFetch(surround_surfaces, clamp(ivec2(place * vec2(size)), ivec2(0), size - 1), 0);
}

// Returns the colour in a direction, unit, world, by fixed-point steps as in search.glsl; alpha 0 where nothing is known.
vec4 around(vec3 ray) {
    vec2 place = place_at(ray);
    vec4 surface = surface_at(place);
    for (int k = 0; k < SURROUND_STEPS && surface.w > 0.0; ++k) {
        vec3 offset = surface.xyz - surround_viewer;
        float along = max(dot(offset + surface.w * direction_at(place), ray), 1e-2);
        vec2 next = place_at(along * ray - offset);
        vec4 there = surface_at(next);
        if (there.w == 0.0) break;
        place = next;
        surface = there;
    }
    vec4 colour = texture(surround, place);
    return surface.w > 0.0 ? vec4(colour.rgb / max(colour.a, 1e-3), 1.0) : vec4(0.0);
}
