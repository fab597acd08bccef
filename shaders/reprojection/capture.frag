// Writes colour and distance of a finished picture into a map of all directions, octahedral (surround.glsl). Twin:
// reference/surround.py.
#from depthwalk.render.reprojection.surround import SURROUND_SIZE
#include "reprojection/surround.glsl"
uniform sampler2D picture;          // sRGB
uniform sampler2D distances;        // metres ahead, of either sign
uniform mat3 picture_from_world;    // takes directions to the axes of the picture's camera: right, up and ahead
uniform vec2 half_extent;           // tangents of half the picture's angles
uniform vec3 seen_from;             // the picture's camera, relative to the map's origin

layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 surface;

void main() {
    vec3 direction = picture_from_world * direction_at(gl_FragCoord.xy / float(SURROUND_SIZE));
    if (any(greaterThan(abs(direction.xy), direction.z * half_extent))) discard;
    vec2 place = 0.5 + 0.5 * direction.xy / (direction.z * half_extent);
    colour = vec4(texture(picture, place).rgb, 1.0);
    surface = vec4(seen_from, abs(texture(distances, place).r) / direction.z);
}
