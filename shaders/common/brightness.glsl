// Perceived brightness, 0 to 1; of what is not there −1, so that it differs from everything.
float brightness(vec4 colour) {
    return sqrt(dot(clamp(colour.rgb, 0.0, 1.0), vec3(0.2126, 0.7152, 0.0722))) + colour.a - 1.0;
}
