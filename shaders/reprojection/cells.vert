// Covers those cells of a picture whose bits are set, each with a rectangle.
#from depthwalk.render.reprojection.picture_cells import CELL_COLUMNS, CELL_ROWS
uniform int cells[CELL_ROWS];   // bit by column, lowest row first

void main() {
    ivec2 cell = ivec2(gl_InstanceID % CELL_COLUMNS, gl_InstanceID / CELL_COLUMNS);
    vec2 uv = vec2(cell + ivec2(gl_VertexID & 1, gl_VertexID >> 1)) / vec2(CELL_COLUMNS, CELL_ROWS);
    bool is_set = ((cells[cell.y] >> cell.x) & 1) == 1;
    gl_Position = is_set ? vec4(uv * 2.0 - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
