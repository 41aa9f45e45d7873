// Records of the mesh passes as texels of four words. A software device gathers a texel of each lane at once,
// and the words of a storage buffer one by one, lane after lane: a texel costs it less than a word does. Needs
// fibre.glsl and mesh.glsl.

struct Joint {
    vec4 rotation;
    vec3 translation; // [m]
    float scale;
};

uvec4 texel_at(usamplerBuffer texels, uint at) {
    return texelFetch(texels, int(at));
}

vec4 floats_at(usamplerBuffer texels, uint at) {
    return uintBitsToFloat(texel_at(texels, at));
}

/// A word of a buffer.
uint word_at(usamplerBuffer texels, uint word) {
    return texel_at(texels, word >> 2)[word & 3u];
}

Joint joint_at(usamplerBuffer joints, uint index) {
    vec4 place = floats_at(joints, 2u * index + 1u);
    return Joint(floats_at(joints, 2u * index), place.xyz, place.w);
}

Rest rest_at(usamplerBuffer rests, uint index) {
    vec4 place = floats_at(rests, 3u * index + 1u);
    float reach = floats_at(rests, 3u * index + 2u).x;
    return Rest(floats_at(rests, 3u * index), place.xyz, place.w, reach, uvec3(0u));
}

Object object_at(usamplerBuffer objects, uint first, uint index) {
    vec3 previous = floats_at(objects, first + 2u * index).xyz;
    return Object(previous, 0u, floats_at(objects, first + 2u * index + 1u).xyz, 0u);
}

Mesh mesh_at(usamplerBuffer meshes, uint index) {
    uvec4 a = texel_at(meshes, 3u * index);
    uvec4 b = texel_at(meshes, 3u * index + 1u);
    vec4 bounds = floats_at(meshes, 3u * index + 2u);
    return Mesh(a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, bounds.xyz, bounds.w);
}

Level level_at(usamplerBuffer levels, uint index) {
    uvec4 a = texel_at(levels, 2u * index);
    uvec4 b = texel_at(levels, 2u * index + 1u);
    return Level(a.x, a.y, a.z, a.w, uintBitsToFloat(b.x), b.y, uintBitsToFloat(b.z), b.w);
}

RestVertex rest_vertex_at(usamplerBuffer vertices, uint index) {
    uvec4 a = texel_at(vertices, 2u * index);
    uvec4 b = texel_at(vertices, 2u * index + 1u);
    return RestVertex(uintBitsToFloat(a.xyz), a.w, b.x, uintBitsToFloat(b.y), uintBitsToFloat(b.z), b.w);
}

RestRow rest_row_at(usamplerBuffer rows, uint index) {
    uvec4 a = texel_at(rows, index);
    return RestRow(unpacked_normal(a.x), unpacked_normal(a.y), unpackHalf2x16(a.z), unpackHalf2x16(a.w));
}

Instance instance_at(usamplerBuffer instances, uint first, uint index) {
    uint at = first + 5u * index;
    uvec4 a = texel_at(instances, at);
    uvec4 b = texel_at(instances, at + 1u);
    vec4 c = floats_at(instances, at + 2u);
    uvec4 d = texel_at(instances, at + 3u);
    vec2 value_fade = uintBitsToFloat(d.xy);
    vec4 bounds = floats_at(instances, at + 4u);
    return Instance(a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x, c.y, c.z, c.w, value_fade.x, value_fade.y, d.z, d.w,
        bounds.xyz, bounds.w);
}

Part part_at(usamplerBuffer parts, uint index) {
    uvec4 a = texel_at(parts, 4u * index);
    uvec4 b = texel_at(parts, 4u * index + 1u);
    uvec4 c = texel_at(parts, 4u * index + 2u);
    uvec4 d = texel_at(parts, 4u * index + 3u);
    return Part(a.x, a.y, a.z, a.w, uintBitsToFloat(b.xyz), b.w, c.x, c.y, c.z, c.w, d.x, d.y, uintBitsToFloat(d.z), d.w);
}
