#include "common/rotation.glsl"
#include "common/gbuffer.glsl"
#include "common/depth_images.glsl"

uniform float pixel_angle;

in vec3 point;
in vec3 from_viewer;
flat in uint image;
flat in vec4 rotation;
flat in float scale;

layout(location = 0) out vec4 out_albedo;
layout(location = 1) out vec4 out_surface;

void main() {
    Surface surface = surface_at(point, int(image), length(from_viewer) * pixel_angle / scale);
    out_albedo = encode_albedo(surface.albedo, surface.specular);
    out_surface = encode_surface(rotate(rotation, surface.normal), shininess);
}
