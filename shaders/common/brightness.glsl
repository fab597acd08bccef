// Computes perceived brightness, 0 to 1: the square root of the luminance (Rec. 709) of linear colour. Of transparent pixels
// it is −1, so that these differ from everything.
float brightness(vec4 colour) {
    return sqrt(dot(clamp(colour.rgb, 0.0, 1.0), vec3(0.2126, 0.7152, 0.0722))) + colour.a - 1.0;
}
