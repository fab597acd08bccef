// Fetches records that a texture holds, see `RecordTexture` in gpu/instances.py.
#from depthwalk.gpu.instances import RECORDS_PER_ROW

// Texel `part` of record `number`, in a texture with `texels` per record.
vec4 record_part(sampler2D records, int texels, int number, int part) {
    return texelFetch(records, ivec2(number % RECORDS_PER_ROW * texels + part, number / RECORDS_PER_ROW), 0);
}
