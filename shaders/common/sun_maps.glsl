// Computes the part of the sun's light that reaches a point, from cascaded shadow maps (Zhang et al. 2006), in world vectors
// from the viewer. Twin: reference/shadows.py.
#from depthwalk.scene.effect_settings import MAX_CASCADES
#from depthwalk.render.shadows.cascades import DEPTH as MAP_DEPTH
#from depthwalk.render.shadows.sun_uniforms import COLUMNS as MAP_COLUMNS
#include "common/shadow_map.glsl"
uniform sampler2DShadow sun_maps;   // tiles of equal size, MAP_COLUMNS to a row
uniform int cascades;               // the nearest first
uniform mat3 light_from_world;      // to the right, up and away from the sun
// Offset (xyz) and factor (w) of each cascade that map metres in the light's frame, from the viewer, to 0 … 1 across the map.
uniform vec4 places[MAX_CASCADES];
uniform int map_resolution;         // texels along a tile's edge
uniform float shadow_reach;         // distance from the viewer at which shadows end, metres

// At `away` times `ray` from the viewer. ray: 1 m along the view axis; normal: world.
float sun_share_at(vec3 ray, float away, vec3 normal) {
    normal = light_from_world * normal;
    float metres = away * length(ray);
    if (metres >= shadow_reach || normal.z >= 0.0) return 1.0;
    vec3 point = (light_from_world * ray + normal * seen_error) * away;
    vec3 offset = normal * lift(length(normal.xy)) / float(map_resolution);
    float margin = map_margin(map_resolution);
    for (int k = 0; k < cascades; ++k) {
        vec3 at = point * places[k].w + places[k].xyz + offset;
        // A map is MAP_DEPTH times as deep as wide.
        at.z = 0.5 + (at.z - 0.5) / MAP_DEPTH;
        // Outside the map, also in depth: from high above, distant ground may be in line with a near cascade.
        if (any(lessThan(at, vec3(vec2(margin), 0.0))) || any(greaterThan(at, vec3(vec2(1.0 - margin), 1.0)))) continue;
        float fade = clamp(10.0 * metres / shadow_reach - 9.0, 0.0, 1.0);
        return mix(filtered(sun_maps, vec2(k % MAP_COLUMNS, k / MAP_COLUMNS), map_resolution, at), 1.0, fade);
    }
    return 1.0;
}
