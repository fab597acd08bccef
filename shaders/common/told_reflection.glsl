// Returns strength and exponent of the highlight of a surface that maps tell roughness and metalness of, under light that it does
// not reflect. reflection: roughness and metalness. Twin: ingest/gltf_reflection.py.
#from depthwalk.ingest.mesh import DIELECTRIC_HIGHLIGHT
#from depthwalk.limits import MAX_SHININESS
vec2 highlight_of(vec2 reflection) {
    float square = max(reflection.x, 0.1) * max(reflection.x, 0.1);
    float strength = (1.0 - reflection.x) * mix(DIELECTRIC_HIGHLIGHT, 1.0, reflection.y);
    return vec2(strength, clamp(2.0 / (square * square) - 2.0, 1.0, MAX_SHININESS));
}
