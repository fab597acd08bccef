// Fetches the object and the vertex that an index of mesh clusters encodes: see render/resources/cluster_object.py.
#include "common/records.glsl"
#from depthwalk.render.resources.cluster_object import CLUSTER_VERTEX
#from depthwalk.render.resources.placed_records import PLACED_RECORD
uniform sampler2D cluster_vertices;  // CLUSTER_VERTEX
uniform sampler2D cluster_objects;   // PLACED_RECORD
uniform int vertex_count;            // of the mesh
uniform int first_object;            // that indices count from

int cluster_object() { return gl_VertexID / vertex_count + first_object; }
int cluster_vertex() { return gl_VertexID % vertex_count; }
