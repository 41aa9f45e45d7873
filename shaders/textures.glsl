// Textures: an array for each size, at the bindings from TEXTURES on; host/render/src/layers has them. A
// handle has the size in its high half, 0 to 2, and the layer in its low half.

layout(set = 0, binding = TEXTURES) uniform sampler2DArray textures_64;
layout(set = 0, binding = TEXTURES + 1) uniform sampler2DArray textures_256;
layout(set = 0, binding = TEXTURES + 2) uniform sampler2DArray textures_512;

/// Bit n: the picture has textures of size n; the others are not compiled in.
layout(constant_id = 4) const uint SIZES = 7u;

/// Whether to look into the array of a size.
bool is_of(uint handle, uint size) {
    return (SIZES & 1u << size) != 0u && (SIZES == 1u << size || handle >> 16 == size);
}

/// A texture's linear light times coverage, and coverage, where it is of one of the greater sizes; else
/// `found`. `spread`: log2 of the share of the texture's side that a pixel is.
vec4 larger_texel(uint handle, vec2 at, float spread, vec4 found) {
    vec3 place = vec3(at, float(handle & 0xffffu));
    // A software rasteriser leaves out a loop that no invocation enters, and a branch never.
    for (uint once = is_of(handle, 1u) ? 0u : 1u; once < 1u; once++) found = textureLod(textures_256, place, spread + 8.0);
    for (uint once = is_of(handle, 2u) ? 0u : 1u; once < 1u; once++) found = textureLod(textures_512, place, spread + 9.0);
    return found;
}

/// The same of a texture of any size.
vec4 texel_of(uint handle, vec2 at, float spread) {
    vec4 found = vec4(0.0);
    vec3 place = vec3(at, float(handle & 0xffffu));
    for (uint once = is_of(handle, 0u) ? 0u : 1u; once < 1u; once++) found = textureLod(textures_64, place, spread + 6.0);
    return larger_texel(handle, at, spread, found);
}
