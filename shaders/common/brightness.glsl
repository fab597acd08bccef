// Computes perceived brightness, 0 to 1: the square root of the luminance (Rec. 709) of linear colour. For transparent pixels
// it is −1, so that these differ from everything.
#from depthwalk.colour import LUMINANCE
float brightness(vec4 colour) {
    return sqrt(dot(clamp(colour.rgb, 0.0, 1.0), LUMINANCE)) + colour.a - 1.0;
}
