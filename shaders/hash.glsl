// Integer hashes and noise built on them: the same bytes on every device.

uint hash_u32(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

float hash_unit(uint x) {
    return float(hash_u32(x) >> 8) * (1.0 / 16777216.0);
}

float hash_cell(ivec3 c, uint seed) {
    return hash_unit(uint(c.x) * 0x9e3779b1u ^ hash_u32(uint(c.y) * 0x85ebca6bu ^ hash_u32(uint(c.z) + seed)));
}

/// Smooth value noise in 0..1 with unit cells.
float value_noise(vec3 p, uint seed) {
    vec3 f = floor(p);
    ivec3 c = ivec3(f);
    vec3 t = p - f;
    t = t * t * (3.0 - 2.0 * t);
    float x00 = mix(hash_cell(c, seed), hash_cell(c + ivec3(1, 0, 0), seed), t.x);
    float x10 = mix(hash_cell(c + ivec3(0, 1, 0), seed), hash_cell(c + ivec3(1, 1, 0), seed), t.x);
    float x01 = mix(hash_cell(c + ivec3(0, 0, 1), seed), hash_cell(c + ivec3(1, 0, 1), seed), t.x);
    float x11 = mix(hash_cell(c + ivec3(0, 1, 1), seed), hash_cell(c + ivec3(1, 1, 1), seed), t.x);
    return mix(mix(x00, x10, t.y), mix(x01, x11, t.y), t.z);
}
