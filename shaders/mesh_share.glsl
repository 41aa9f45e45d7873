// Which pixels a mesh has where it fades, or where one level of detail fades into another. Needs tone.glsl.

/// Whether a pixel lies in a share of all, from `x` to `y`: two levels' shares fill a surface without a gap.
bool has_pixel(vec2 share, vec2 pixel) {
    // Another order of the same noise than the last step's dither.
    float noise = dither(pixel.yx);
    return noise >= share.x && noise < share.y;
}
