// Computes the linear radiance of the sky in a world direction, of unit length. Twin: render/lighting/sky.py.
// PREETHAM: Preetham, Shirley and Smits 1999, "A Practical Analytic Model for Daylight"; SKY_IMAGE: an equirectangular
// picture (twin: reference/image_sky.py); else from horizon to zenith.
#ifdef PREETHAM
#from depthwalk.render.lighting.sky import RGB_FROM_XYZ
uniform vec3 perez[5];      // A to E of Y, x and y
uniform vec3 at_zenith;     // these over Perez' function at the zenith
uniform vec3 sky_sun;       // to the sun, not below the horizon

vec3 sky_at(vec3 direction) {
    float up = max(direction.y, 1e-3), cosine = clamp(dot(direction, sky_sun), -1.0, 1.0);
    vec3 rise = 1.0 + perez[0] * exp(perez[1] / up);
    vec3 aside = 1.0 + perez[2] * exp(perez[3] * acos(cosine)) + perez[4] * cosine * cosine;
    vec3 seen = at_zenith * rise * aside;   // Y, x, y
    vec3 xyz = seen.x / seen.z * vec3(seen.y, seen.z, 1.0 - seen.y - seen.z);
    return max(RGB_FROM_XYZ * xyz, 0.0);
}
#elif defined SKY_IMAGE
#include "common/view.glsl"
#from depthwalk.render.lighting.image_sky import HORIZON_ORDER, HORIZON_TERMS
uniform sampler2D sky_image;    // row 0 at the zenith, the middle column toward -z; repeats horizontally
uniform float sky_turn;         // radians, counter-clockwise seen from above
uniform float sky_intensity;
uniform vec3 horizon_terms[HORIZON_TERMS];  // of 1, cos a, sin a, cos 2a, ... of the azimuth a from -z toward +x
const float HALF_TURN = 3.14159265358979;

// The level is chosen by the pixel's size alone: where rows get short, towards the poles, neighbours hold the same light. As
// it is explicit, the jump of the coordinate behind the viewer leaves no seam.
vec3 sky_at(vec3 direction) {
    // A pixel covers pixel_angle² cos³ a steradians at the angle a from the view axis.
    float cosine = dot(direction, normalize(cross(ray_from_screen[0], ray_from_screen[1])));
    float texels = pixel_angle * pow(abs(cosine), 1.5) * float(textureSize(sky_image, 0).y) / HALF_TURN;
    float azimuth = atan(direction.x, direction.z == 0.0 ? 1e-9 : -direction.z);
    float from_zenith = atan(length(direction.xz), direction.y);    // acos would be inexact near the poles
    vec2 place = vec2(0.5 + 0.5 * (azimuth + sky_turn) / HALF_TURN, from_zenith / HALF_TURN);
    return sky_intensity * textureLod(sky_image, place, log2(max(texels, 1e-6))).rgb;
}

// The colour of the horizon, smoothed, in a world direction of unit length; the steeper that is, the more even.
vec3 horizon_at(vec3 direction) {
    vec3 colour = horizon_terms[0];
    vec2 around = vec2(-direction.z, direction.x), power = vec2(1.0, 0.0);     // complex numbers
    for (int k = 1; k <= HORIZON_ORDER; k++) {
        power = vec2(power.x * around.x - power.y * around.y, power.x * around.y + power.y * around.x);
        colour += power.x * horizon_terms[2 * k - 1] + power.y * horizon_terms[2 * k];
    }
    return max(colour, 0.0);
}
#else
uniform vec3 zenith;        // both are the plain background if there is no sky
uniform vec3 horizon;

vec3 sky_at(vec3 direction) { return mix(horizon, zenith, sqrt(clamp(direction.y, 0.0, 1.0))); }
#endif
