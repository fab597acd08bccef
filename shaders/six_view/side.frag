// Writes the samples of the unrolled cylinder: depth in metres, normal in the object frame, linear colour.
in float depth;
in vec3 normal;
in vec4 albedo;
in vec4 facing;

layout(location = 0) out vec4 out_normal;  // and depth
layout(location = 1) out vec4 out_albedo;
layout(location = 2) out vec4 out_facing;

void main() {
    out_normal = vec4(normalize(normal), depth);
    out_albedo = albedo;
    out_facing = vec4(normalize(facing.xyz), facing.w < 0.0 ? -1.0 : 1.0);  // never 0: that is an empty texel
}
