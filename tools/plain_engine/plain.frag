// Lights a surface and encodes its colour for the screen, in one go, as forward renderers do.
#include "common/phong.glsl"
#include "common/srgb.glsl"
uniform vec3 base_colour;   // linear
uniform float specular;
uniform float shininess;

in vec3 normal;
in vec3 from_viewer;

layout(location = 0) out vec4 result;

void main() {
    vec3 facing = normalize(gl_FrontFacing ? normal : -normal);
    vec3 direct = sun * phong(base_colour, specular, shininess, facing, normalize(from_viewer), to_sun);
    result = vec4(srgb_from_linear(clamp(base_colour * everywhere(facing) + direct, 0.0, 1.0)), 1.0);
}
