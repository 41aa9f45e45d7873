// A tile of the sea bed: a small grid whose vertices slide onto the next coarser grid with distance, so that
// no seam opens and nothing jumps. Needs view.glsl and QUADS, the quads along a side.
//
// Vertices are whole numbers of the height field's cells, and where one is drawn follows from these and its
// level alone: so two tiles put a vertex that they share at the same place to the last bit. Where tiles of
// two levels meet, the finer one's vertices have arrived on the coarser grid and go on as its vertices do.

layout(set = 0, binding = 1, std430) readonly buffer Heights { vec4 heights[]; }; // height, slope in x and z
layout(set = 0, binding = 2, std430) readonly buffer Tiles { ivec4 tiles[]; };    // column and row of the corner, step, 0 [cells]

/// Height and slopes at `c`, in cells from the height that the view names; level beyond the field.
vec4 ground(vec2 c) {
    ivec2 size = ivec2(view.terrain_size.xy);
    vec2 corner = floor(c);
    ivec2 wanted = ivec2(corner) + ivec2(view.bed.zw);
    ivec2 at = clamp(wanted, ivec2(0), size - 2);
    vec2 t = clamp(c - corner + vec2(wanted - at), 0.0, 1.0);
    int i = at.y * size.x + at.x;
    return mix(mix(heights[i], heights[i + 1], t.x), mix(heights[i + size.x], heights[i + size.x + 1], t.x), t.y);
}

/// How far the vertices that end at `at`, on the grid coarser than one with this step, have gone there: 1
/// where tiles of this step end, three sides of a tile from the eye. All of them go together, and in steps,
/// so that no triangle becomes so narrow that a rasteriser loses it.
float gone(ivec2 at, int step) {
    vec2 p = view.terrain_origin.xy + vec2(at - ivec2(view.bed.zw)) * view.terrain_origin.z;
    float range = 3.0 * float(QUADS) * view.terrain_origin.z * float(step);
    return floor(clamp((length(vec3(p, view.bed.y)) / range - 0.7) / 0.25, 0.0, 1.0) * 32.0) * 0.03125;
}

/// The place on the grid coarser than one with this step where a vertex ends.
ivec2 coarser(ivec2 at, int step) {
    return at & ~(2 * step - 1);
}

/// This vertex in eye space, with the ground's slope.
vec3 tile_vertex(out vec2 slope) {
    ivec4 tile = tiles[gl_InstanceIndex];
    int step = tile.z;
    ivec2 at = tile.xy + ivec2(gl_VertexIndex % (QUADS + 1), gl_VertexIndex / (QUADS + 1)) * step;
    // A tile's far corner may lie where the next level, too, has given way.
    for (int i = 0; i < 2; i++) {
        step = gone(coarser(at, step), step) < 1.0 ? step : step * 2;
        at &= ~(step - 1);
    }
    ivec2 end = coarser(at, step);
    ivec2 base = ivec2(view.bed.zw);
    vec2 c = mix(vec2(at - base), vec2(end - base), gone(end, step));
    vec4 g = ground(c);
    slope = g.yz;
    vec2 p = view.terrain_origin.xy + c * view.terrain_origin.z;
    return vec3(p.x, g.x + view.terrain_origin.w, p.y);
}
