// Keeps how far along the view axis a finished picture's surfaces are, metres; BEYOND where nothing was drawn.
#from depthwalk.render.reprojection import BEYOND
uniform sampler2D depth_texture;
uniform vec2 planes;            // near and far plane, metres

in vec2 uv;
layout(location = 0) out float ahead;

void main() {
    float depth = texture(depth_texture, uv).r;
    ahead = depth < 1.0 ? planes.x * planes.y / (planes.y - depth * (planes.y - planes.x)) : BEYOND;
}
