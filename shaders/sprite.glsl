// Sprites as host/render/src/sprites/mod.rs makes them, and their light.

struct Sprite {
    vec3 place;   // middle in eye space [m]
    float size;   // diameter [m]
    vec3 axis;    // unit normal, zero: turned to the eye
    float roll;   // turn about it [rad]
    uvec2 tint;   // half floats: linear colour times opacity, opacity
    uint layer;   // handle of the texture
};
layout(set = 0, binding = 1, scalar) readonly buffer Sprites { Sprite sprites[]; };

layout(push_constant, scalar) uniform SpritePush {
    float least; // diameter below which a sprite is drawn wider and fainter [px]
} push;

vec4 tint_of(Sprite sprite) {
    return vec4(unpackHalf2x16(sprite.tint.x), unpackHalf2x16(sprite.tint.y));
}

/// Light that a white sprite at `p` sends to the eye, after the water between them: what floats scatters
/// forward, so that it is brighter toward the sun; never dazzling.
vec3 sprite_light(vec3 p) {
    float distance = length(p);
    vec3 direction = p / max(distance, 1e-6);
    float depth = depth_of(p);
    // Henyey and Greenstein, g = .55, beside an even half.
    float x = 1.3025 - 1.1 * dot(direction, view.sun);
    float forward = 0.45 + 0.5 * min(0.6975 * inversesqrt(x) / x, 3.0);
    float caustic = HIGH != 0u ? mix(1.0, caustic_gain(p, depth, 0.0), 0.6) : 1.0;
    vec3 light = sea_light_at(depth) * (view.sun_color * (0.8 * forward * caustic) + view.ambient * 0.9);
    return mix(min(light, vec3(0.95)) * exp(-view.beam * distance), vec3(1.0), in_diagram());
}

/// Light that the water scatters into the way from `p` to the eye.
vec3 sprite_fog(vec3 p) {
    float distance = length(p);
    return mix(scattered_light(p / max(distance, 1e-6), distance), vec3(0.0), in_diagram());
}
