// Transforms the vertices of mesh clusters to clip space as mesh/clusters.vert does, and numbers the objects.
#include "common/cluster_vertex.glsl"
#include "common/rotation.glsl"
#include "common/view.glsl"
uniform int first;      // number of the first object among all polygons that the frame draws

flat out uint number;

void main() {
    int object = cluster_object();
    vec4 origin = record_part(cluster_objects, PLACED_RECORD_TEXELS, object, 0);
    vec4 turn = record_part(cluster_objects, PLACED_RECORD_TEXELS, object, 1);
    vec3 place = record_part(cluster_vertices, CLUSTER_VERTEX_TEXELS, cluster_vertex(), 0).xyz;
    number = uint(first + object);
    gl_Position = clip_from_eye * vec4(origin.xyz + turn.w * rotate(vec4(origin.w, turn.xyz), place), 1.0);
}
