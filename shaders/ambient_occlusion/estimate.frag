// Estimates which part of the ambient light reaches a surface past others close by, from the depth buffer: ground-truth ambient
// occlusion (Jimenez, Wu, Pesce and Jarabo 2016, "Practical Realtime Strategies for Accurate Indirect Occlusion", eq. 5 to 10).
// In planes through the viewer's ray, the horizon to either side of it is the steepest direction in which a surface is seen;
// the cosine-weighted light between the horizons has a closed form. Twin: reference/ambient_occlusion.py.
#include "ambient_occlusion/seen_point.glsl"
#include "common/gbuffer.glsl"
uniform usampler2D surface_texture;
uniform float radius;       // metres, within which surfaces hide each other from ambient light
uniform int directions;     // planes through the ray
uniform int steps;          // depths that are looked at to either side, in each of them

layout(location = 0) out vec2 visibility;   // part of the light; metres along the view axis

const float PI = 3.14159265, HALF_PI = 0.5 * PI;
// Sine of the angle above a surface's plane from which on points count in full: as pixels are not on the very line that is
// searched, those of a plane seem to rise above it.
const float RISES = 0.1;

// A number, 0 to 15/16, that all 4 × 4 texels of a block have different: planes and steps are turned and shifted by it.
float turn_of(ivec2 texel) {
    ivec2 low = texel & 1, high = texel >> 1 & 1;
    return float((low.x ^ low.y) * 8 + low.y * 4 + (high.x ^ high.y) * 2 + high.y) / 16.0;
}

// The light between the normal's plane and the horizon, of an angle from the ray; turned: the normal's (eq. 7).
float light_up_to(float horizon, float turned) {
    return 0.25 * (cos(turned) + 2.0 * horizon * sin(turned) - cos(2.0 * horizon - turned));
}

// The cosine of the steepest horizon from `point` along a line in the picture.
// to_viewer, normal: of unit length; along: pixels; lowest: the cosine of the horizon where nothing hides anything.
float horizon_cosine(vec3 point, vec3 to_viewer, vec3 normal, ivec2 pixel, vec2 along, float shift, float lowest) {
    float highest = lowest;
    for (int step = 0; step < steps; ++step) {
        float part = (float(step) + shift) / float(steps);
        ivec2 at = pixel + ivec2(round(along * part * part + sign(along)));     // denser close by, never the pixel itself
        if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, textureSize(depth_texture, 0)))) continue;
        vec3 beside = seen_point(at) - point;
        float away = max(length(beside), 1e-6);
        // Fades out towards the radius, so that what passes it does not pop.
        float fade = clamp(2.0 - 2.0 * away / radius, 0.0, 1.0) * clamp(dot(beside, normal) / (RISES * away), 0.0, 1.0);
        highest = max(highest, mix(lowest, dot(beside, to_viewer) / away, fade));
    }
    return clamp(highest, -1.0, 1.0);
}

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy), pixel = shown_pixel(texel);
    float depth = texelFetch(depth_texture, pixel, 0).r, distance = distance_of(depth);
    visibility = vec2(1.0, distance);
    if (depth == 1.0) return;
    vec3 point = seen_point(pixel, distance), to_viewer = -normalize(point);
    vec3 normal = normal_of(texelFetch(surface_texture, pixel, 0).xy);
    vec3 right = normalize(ray_from_screen[0]), up = normalize(ray_from_screen[1]);
    float reach = radius / (distance * pixel_angle);    // pixels
    float turn = turn_of(texel), shift = fract(turn * 4.0 + 0.125);
    float light = 0.0, open_light = 0.0;
    for (int direction = 0; direction < directions; ++direction) {
        float angle = PI * (float(direction) + turn) / float(directions);
        vec2 along = vec2(cos(angle), sin(angle));
        vec3 aside = right * along.x + up * along.y;
        vec3 tangent = normalize(aside - dot(aside, to_viewer) * to_viewer), across = cross(tangent, to_viewer);
        vec3 flat_normal = normal - dot(normal, across) * across;   // in the plane of ray and line
        float weight = length(flat_normal);
        if (weight < 1e-4) continue;
        float cosine = clamp(dot(flat_normal, to_viewer) / weight, -1.0, 1.0);
        float turned = dot(flat_normal, tangent) < 0.0 ? -acos(cosine) : acos(cosine);
        float low_before = max(turned - HALF_PI, -PI), low_after = min(turned + HALF_PI, PI);
        float before = -acos(horizon_cosine(point, to_viewer, normal, pixel, -reach * along, shift, cos(low_before)));
        float after = acos(horizon_cosine(point, to_viewer, normal, pixel, reach * along, shift, cos(low_after)));
        light += weight * (light_up_to(max(before, low_before), turned) + light_up_to(min(after, low_after), turned));
        open_light += weight * (light_up_to(low_before, turned) + light_up_to(low_after, turned));
    }
    // By what would reach it if nothing were in the way, as few planes do not add up to the whole hemisphere.
    visibility.x = open_light > 0.0 ? clamp(light / open_light, 0.0, 1.0) : 1.0;
}
