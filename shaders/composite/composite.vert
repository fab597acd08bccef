// Pass 2: one rectangle per object, the part of the plane that its intermediate image covers.
uniform mat4 clip_from_eye;     // clip coordinates of a world vector from the viewer

in vec3 in_corner;              // world vectors from the viewer to the rectangle's corner and along its edges
in vec3 in_edge_u;
in vec3 in_edge_v;
in vec3 in_texel;               // texels from the tile's corner, homogeneous, there
in vec3 in_texel_u;
in vec3 in_texel_v;
in vec3 in_viewer;              // object frame
in vec4 in_rotation;
in vec4 in_tile;                // x, y, width, height in texels
in vec2 in_scales;              // the object's scale; the tile's least w / λ

out vec3 ray;                   // world, from the viewer to the plane
out vec3 in_tile_texel;         // homogeneous
flat out vec3 viewer;
flat out vec4 rotation;
flat out vec4 tile;
flat out vec2 scales;

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    ray = in_corner + corner.x * in_edge_u + corner.y * in_edge_v;
    in_tile_texel = in_texel + corner.x * in_texel_u + corner.y * in_texel_v;
    viewer = in_viewer;
    rotation = in_rotation;
    tile = in_tile;
    scales = in_scales;
    gl_Position = clip_from_eye * vec4(ray, 1.0);
}
