// Computes the linear radiance of the sky in a world direction, of unit length. Twin: render/lighting/sky.py.
// PREETHAM: Preetham, Shirley and Smits 1999, "A Practical Analytic Model for Daylight"; else from horizon to zenith.
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
#else
uniform vec3 zenith;        // both are the plain background if there is no sky
uniform vec3 horizon;

vec3 sky_at(vec3 direction) { return mix(horizon, zenith, sqrt(clamp(direction.y, 0.0, 1.0))); }
#endif
