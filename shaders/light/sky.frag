// Where nothing is, the sky or the plain background.
uniform vec3 zenith;            // both the plain background where there is no sky
uniform vec3 horizon;
uniform int transparent;        // nothing is left

in vec3 ray;
layout(location = 0) out vec4 lit;

void main() {
    float rise = sqrt(clamp(normalize(ray).y, 0.0, 1.0));
    lit = transparent != 0 ? vec4(0.0) : vec4(mix(horizon, zenith, rise), 1.0);
}
