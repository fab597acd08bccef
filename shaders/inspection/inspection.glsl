// Shows the inputs of lighting instead of light, or how objects are drawn. Twin: reference/inspection.py.
#include "common/gbuffer.glsl"
#include "common/pixel.glsl"
#include "common/records.glsl"
#include "common/srgb.glsl"
#include "common/visibility.glsl"
#from depthwalk.reference.inspection import SIDEWAYS
#from depthwalk.render.draw.object_colours import GROUND_COLOUR
#from depthwalk.render.resources.placed_records import NUMBERED_CLUSTERS, NUMBERED_MESH
uniform float half_distance;
uniform usampler2D visibility_texture;
uniform sampler2D object_colours;   // COLOUR_RECORD by the object's number, 0: what has no number; then those of polygons
uniform int first_mesh;             // record of the first mesh that is drawn whole
uniform int first_clustered;        // and of the first that is drawn by clusters
uniform vec3 captured_colour;

// The false colour of what a pixel of the visibility buffer shows, sRGB.
vec3 false_colour(uvec2 visibility) {
    if (visibility == GROUND) return GROUND_COLOUR;
    if (is_captured(visibility)) return captured_colour;
    int record = int(object_of(visibility)), number = int(number_of(visibility));
    if (visibility.x == uint(NUMBERED_MESH)) record = first_mesh + number;
    if (visibility.x == uint(NUMBERED_CLUSTERS)) record = first_clustered + number;
    return record_part(object_colours, 1, record, 0).rgb;
}

void draw_inspection(inout Pixel pixel) {
#if defined(SKY) && defined(TRANSPARENT)
    pixel.lit = vec4(0.0);
#elif defined(SKY)
    pixel.lit = vec4(0.0, 0.0, 0.0, 1.0);
#elif defined(NORMALS)
    pixel.lit = vec4(linear_from_srgb(0.5 + 0.5 * normal_of(pixel.surface)), 1.0);
#elif defined(DISTANCE)
    pixel.lit = vec4(linear_from_srgb(vec3(exp2(-distance_of(pixel.depth) / half_distance))), 1.0);
#elif defined(HOW_DRAWN)
    vec3 colour = false_colour(texelFetch(visibility_texture, ivec2(gl_FragCoord.xy), 0).xy);
    float facing = abs(dot(normal_of(pixel.surface), normalize(pixel.ray)));    // as if the viewer held a lamp, so that shapes show
    pixel.lit = vec4(linear_from_srgb(mix(SIDEWAYS, 1.0, facing) * colour), 1.0);
#else
    pixel.lit = vec4(albedo_of(pixel.surface), 1.0);
#endif
}
