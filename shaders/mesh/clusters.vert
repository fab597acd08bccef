// Transforms the vertices of mesh clusters from their asset's frame to clip space, as mesh.vert does. PAINTED, NORMAL_MAP, NUMBERED: see mesh.frag.
#include "common/cluster_vertex.glsl"
#include "common/rotation.glsl"
#include "common/srgb.glsl"
#include "common/view.glsl"
#ifdef PAINTED
uniform sampler2D cluster_colours;   // sRGB
#endif

centroid out vec3 normal;
#ifdef PAINTED
centroid out vec3 colour;
centroid out vec2 uv;
#endif
#ifdef NORMAL_MAP
out vec3 place;
out vec2 place_uv;
#endif
#ifdef NUMBERED
uniform int first_number;   // of the first record of the phase, among those of the frame
flat out uint number;
#endif

void main() {
    int object = cluster_object(), vertex = cluster_vertex();
    vec4 origin = record_part(cluster_objects, PLACED_RECORD_TEXELS, object, 0);
    vec4 turn = record_part(cluster_objects, PLACED_RECORD_TEXELS, object, 1);
    vec4 rotation = vec4(origin.w, turn.xyz);
    vec4 position = record_part(cluster_vertices, CLUSTER_VERTEX_TEXELS, vertex, 0);
    vec4 look = record_part(cluster_vertices, CLUSTER_VERTEX_TEXELS, vertex, 1);
    normal = rotate(rotation, vec3(position.w, look.xy));
#ifdef PAINTED
    vec3 srgb = record_part(cluster_colours, 1, vertex, 0).rgb;
    colour = linear_from_srgb(srgb);
    uv = look.zw;
#endif
#ifdef NORMAL_MAP
    place = origin.xyz + turn.w * rotate(rotation, position.xyz);
    place_uv = look.zw;
#endif
#ifdef NUMBERED
    number = uint(first_number + object);
#endif
    gl_Position = clip_from_eye * vec4(origin.xyz + turn.w * rotate(rotation, position.xyz), 1.0);
}
