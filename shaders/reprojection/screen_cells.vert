// Covers those cells of the screen whose bits are set, each with a rectangle; uv runs over [0, 1] in the screen.
#from depthwalk.render.reprojection import SCREEN_COLUMNS, SCREEN_ROWS
uniform int cells[SCREEN_ROWS];     // bit by column, lowest row first

out vec2 uv;

void main() {
    ivec2 cell = ivec2(gl_InstanceID % SCREEN_COLUMNS, gl_InstanceID / SCREEN_COLUMNS);
    uv = vec2(cell + ivec2(gl_VertexID & 1, gl_VertexID >> 1)) / vec2(SCREEN_COLUMNS, SCREEN_ROWS);
    bool is_set = (cells[cell.y] >> cell.x & 1) == 1;
    gl_Position = is_set ? vec4(uv * 2.0 - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
