// Shows a tile of the screen whose places in the finished picture are interpolated from those of its corners.
#from depthwalk.render.reprojection.smooth_tiles import TILE
uniform sampler2D picture;  // sRGB

flat in vec2 corner, across, up, twist;
layout(location = 0) out vec4 screen;

void main() {
    vec2 at = mod(gl_FragCoord.xy, float(TILE));
    screen = texture(picture, corner + at.x * across + at.y * (up + at.x * twist));
}
