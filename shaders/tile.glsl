// A tile of the sea bed: a small grid whose odd vertices slide onto the next coarser grid with distance, so that no
// seam opens and nothing jumps. Needs view.glsl and QUADS, the
// quads along a side.

layout(set = 0, binding = 1, std430) readonly buffer Heights { vec4 heights[]; }; // height, slope in x and z
layout(set = 0, binding = 2, std430) readonly buffer Tiles { vec4 tiles[]; };     // x, z in eye space, spacing, range

vec4 ground(vec2 p) {
    vec2 size = view.terrain_size.xy;
    vec2 at = clamp((p - view.terrain_origin.xy) / view.terrain_origin.z, vec2(0.0), size - 1.001);
    ivec2 c = ivec2(at);
    vec2 t = at - vec2(c);
    int columns = int(size.x);
    int i = c.y * columns + c.x;
    return mix(mix(heights[i], heights[i + 1], t.x), mix(heights[i + columns], heights[i + columns + 1], t.x), t.y);
}

/// This vertex in eye space, with the ground's slope.
vec3 tile_vertex(out vec2 slope) {
    vec4 tile = tiles[gl_InstanceIndex];
    vec2 cell = vec2(gl_VertexIndex % (QUADS + 1), gl_VertexIndex / (QUADS + 1));
    vec2 p = tile.xy + cell * tile.z;
    vec4 g = ground(p);
    float distance = length(vec3(p.x, g.x + view.terrain_origin.w, p.y));
    float morph = clamp((distance / tile.w - 0.7) / 0.25, 0.0, 1.0);
    p -= fract(cell * 0.5) * 2.0 * tile.z * morph;
    g = ground(p);
    slope = g.yz;
    return vec3(p.x, g.x + view.terrain_origin.w, p.y);
}
