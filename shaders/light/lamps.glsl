// Adds up the light of lamps at a point, a world vector from the viewer, from a list for each cell of the view (clustered
// shading, Olsson, Billeter and Assarsson 2012). Twin: reference/light.py.
#include "common/records.glsl"
#from depthwalk.render.lighting.light_clusters import LAMP_RECORD, SQUARE, SLICES, SLICES_PER_DOUBLING
uniform sampler2D lamps;        // LAMP_RECORDs
uniform sampler2D lamp_lists;   // their numbers, four to a texel, cell by cell
uniform sampler2D lamp_cells;   // of each cell, the first in the list, how many, and how many of these, first, have maps
uniform ivec2 squares;          // columns and rows of cells in the picture
#ifdef LAMP_SHADOWS
#include "common/shadow_map.glsl"
#from depthwalk.render.shadows.spot_maps import NEAR as MAP_NEAR    // of a lamp's range, where its map begins
uniform sampler2DShadow lamp_maps;
uniform int lamp_map_columns;       // of tiles
uniform int lamp_map_resolution;    // texels along a tile's edge
#endif

vec4 lamp_part(int number, int part) { return record_part(lamps, LAMP_RECORD_TEXELS, number, part); }
int lamp_number(int k) { return int(record_part(lamp_lists, 1, k / 4, 0)[k % 4]); }

#ifdef LAMP_SHADOWS
// What part of a spot light's light reaches a point, from the lamp, that is in its cone. axis: of the cone; shadow: as in
// LAMP_RECORD.
float lamp_share(vec3 point, float range, vec3 axis, vec4 shadow, vec3 normal) {
    vec3 right = shadow.xyz, up = cross(right, axis);
    float texel = 2.0 * dot(point, axis) * inversesqrt(dot(right, right)) / float(lamp_map_resolution);
    point += normal * texel * lift(length(cross(normal, axis)));
    float along = dot(point, axis), margin = map_margin(lamp_map_resolution);
    vec2 at = clamp(0.5 + 0.5 * vec2(dot(point, right), dot(point, up)) / along, margin, 1.0 - margin);
    float depth = (1.0 - MAP_NEAR * range / along) / (1.0 - MAP_NEAR);
    int tile = int(shadow.w);
    return filtered(lamp_maps, vec2(tile % lamp_map_columns, tile / lamp_map_columns), lamp_map_resolution, vec3(at, depth));
}
#endif

// A point or spot light at `point`, from the viewer, `away` along the view axis: inverse squares with a window that ends
// them at their range (Karis 2013, "Real Shading in Unreal Engine 4"), cones that fade towards their edge.
// shadowed: it has a map.
vec3 of_lamp(
    int number, bool shadowed, vec3 point, float away,
    vec3 albedo, float specular, float shininess, vec3 normal, vec3 view
) {
    vec4 place = lamp_part(number, LAMP_RECORD_PLACE), light = lamp_part(number, LAMP_RECORD_LIGHT);
    vec4 cone = lamp_part(number, LAMP_RECORD_CONE);
    vec3 to_lamp = place.xyz - point;
    float square_distance = max(dot(to_lamp, to_lamp), 1e-4);
    float part = square_distance / (place.w * place.w);
    float window = max(1.0 - part * part, 0.0);
    to_lamp *= inversesqrt(square_distance);
    float inside = clamp((-dot(to_lamp, cone.xyz) - light.w) * cone.w, 0.0, 1.0);
    float strength = window * window * inside * inside / square_distance;
#ifdef LAMP_SHADOWS
    if (shadowed && strength > 0.0 && dot(normal, to_lamp) > 0.0) {
        vec3 from_lamp = point + normal * seen_error * away - place.xyz;
        strength *= lamp_share(from_lamp, place.w, cone.xyz, lamp_part(number, LAMP_RECORD_SHADOW), normal);
    }
#endif
    return strength * light.rgb * phong(albedo, specular, shininess, normal, view, to_lamp);
}

// Light of all lamps at `point`. Those with maps have a loop of their own: rasterisers without branches run all of a loop's
// body, but only as often as there is a lamp with a map.
vec3 of_lamps(vec3 point, float away, vec3 albedo, float specular, float shininess, vec3 normal, vec3 view) {
    ivec2 at = ivec2(gl_FragCoord.xy) / SQUARE;
    int cell = (min(int(float(SLICES_PER_DOUBLING) * log2(max(away, 1.0))), SLICES - 1) * squares.y + at.y) * squares.x + at.x;
    ivec3 run = ivec3(record_part(lamp_cells, 1, cell, 0).xyz);
    int k = run.x, end = run.x + run.y;
    vec3 colour = vec3(0.0);
#ifdef LAMP_SHADOWS
    for (int mapped = run.x + run.z; k < mapped; ++k)
        colour += of_lamp(lamp_number(k), true, point, away, albedo, specular, shininess, normal, view);
#endif
    for (; k < end; ++k)
        colour += of_lamp(lamp_number(k), false, point, away, albedo, specular, shininess, normal, view);
    return colour;
}
