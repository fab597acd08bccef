// Shows the inputs of lighting instead of light, or how objects are drawn. Twin: reference/inspection.py.
#include "common/gbuffer.glsl"
#include "common/pixel.glsl"
#include "common/records.glsl"
#include "common/srgb.glsl"
#include "common/visibility.glsl"
#from depthwalk.reference.inspection import SIDEWAYS
#from depthwalk.render.draw.object_colours import GROUND_COLOUR
uniform float half_distance;
uniform usampler2D visibility_texture;
uniform sampler2D object_colours;   // COLOUR_RECORD by the object's number, 0: polygons
uniform vec3 captured_colour;

// The false colour of what a pixel of the visibility buffer shows, sRGB.
vec3 false_colour(uvec2 visibility) {
    if (visibility == GROUND) return GROUND_COLOUR;
    int object = int(object_of(visibility));
    if (object == 0 && visibility.y >= uint(FIRST_CAPTURED)) return captured_colour;
    return record_part(object_colours, 1, object, 0).rgb;
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
