// Converts between the coordinates of a height field and the object frame: u and v from 0 to 1 over the picture, then the depth
// behind its plane as a part of the object's.
uniform vec3 field_size;    // of the picture, and its greatest depth, metres
uniform float field_top;    // y of the picture's plane, object frame

vec3 field_from_object(vec3 p) { return vec3(p.xz / field_size.xy + 0.5, (field_top - p.y) / field_size.z); }
vec3 object_from_field(vec3 q) {
    vec2 across = (q.xy - 0.5) * field_size.xy;
    return vec3(across.x, field_top - q.z * field_size.z, across.y);
}
