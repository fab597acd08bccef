// Spreads points over the unit disc: radius √(k + ½) / √n at k times the golden angle (Vogel 1979).
#from depthwalk.render.view.lens import GOLDEN_ANGLE
const mat2 TURN = mat2(cos(GOLDEN_ANGLE), sin(GOLDEN_ANGLE), -sin(GOLDEN_ANGLE), cos(GOLDEN_ANGLE));
