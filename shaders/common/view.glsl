// Declares what a picture or a shadow map is seen through: `VIEW_BLOCK` in Python, filled once per view. World vectors are
// measured from the viewer (of a shadow map: from its centre), so that float32 keeps its precision far from the origin.
layout(std140) uniform View {
    mat4 clip_from_eye;         // clip coordinates of a world vector from the viewer
    mat3 ray_from_screen;       // takes (x, y, 1), −1 to 1, to the world vector to the point seen at (x, y), one metre deep
    vec4 eye;                   // where rays start, from the viewer, homogeneous; w = 0: the direction to a sun infinitely far
    vec3 view_position;         // of the viewer, world
    float pixel_angle;          // metres that a pixel covers at one metre
    vec2 depth_range;           // near and far plane, metres along the view axis
    vec2 depth_from_inverse;    // depth buffer = x − y / distance along the view axis
    vec2 view_size;             // pixels
};
