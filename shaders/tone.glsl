// From scene light to what a display shows: Khronos PBR Neutral without its toe, sRGB, dither.

/// Khronos PBR Neutral: colours below .8 pass unchanged, brighter ones are compressed and lose some
/// saturation.
vec3 neutral_tone(vec3 color) {
    const float start = 0.8;
    const float desaturation = 0.15;
    float peak = max(max(color.r, max(color.g, color.b)), start);
    float d = 1.0 - start;
    float compressed = 1.0 - d * d / (peak + d - start);
    float g = 1.0 / (desaturation * (peak - compressed) + 1.0);
    // At the start of the curve g is 1 and nothing changes, below it neither.
    return mix(vec3(compressed), color * (compressed / peak), g);
}

vec3 srgb_encode(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(vec3(0.0031308), c));
}

vec3 srgb_decode(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c));
}

/// Interleaved gradient noise in 0..1, the same for the same pixel in every frame.
float dither(vec2 pixel) {
    return fract(52.9829189 * fract(dot(floor(pixel), vec2(0.06711056, 0.00583715))));
}
