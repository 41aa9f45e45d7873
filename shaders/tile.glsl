// A tile of the sea bed: a small grid whose vertices slide onto the next coarser grid with distance, so that
// no seam opens and nothing jumps. Needs view.glsl and QUADS, the quads along a side.
//
// Vertices are whole numbers of the height field's cells, and where one is drawn follows from these and its
// level alone: so two tiles put a vertex that they share at the same place to the last bit. Where tiles of
// two levels meet, the finer one's vertices have arrived on the coarser grid and go on as its vertices do.

struct Height {
    float height; // [m]
    vec2 slope;   // in x and z
};

struct Tile {
    ivec2 corner; // column and row [cells]
    int step;     // between vertices [cells]
};

layout(set = 0, binding = 1, scalar) readonly buffer Heights { Height heights[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Tiles { Tile tiles[]; };

vec3 height_at(int index) {
    Height h = heights[index];
    return vec3(h.height, h.slope);
}

/// Height and slopes at `c`, in cells from the height that the view names; level beyond the field.
vec3 ground(vec2 c) {
    ivec2 size = ivec2(view.terrain_size);
    vec2 corner = floor(c);
    ivec2 wanted = ivec2(corner) + ivec2(view.nearest);
    ivec2 at = clamp(wanted, ivec2(0), size - 2);
    vec2 t = clamp(c - corner + vec2(wanted - at), 0.0, 1.0);
    int i = at.y * size.x + at.x;
    return mix(mix(height_at(i), height_at(i + 1), t.x), mix(height_at(i + size.x), height_at(i + size.x + 1), t.x), t.y);
}

/// How far the vertices that end at `at`, on the grid coarser than one with this step, have gone there: 1
/// where tiles of this step end, three sides of a tile from the eye. All of them go together, and in steps,
/// so that no triangle becomes so narrow that a rasteriser loses it.
float gone(ivec2 at, int step) {
    vec2 p = view.terrain_origin + vec2(at - ivec2(view.nearest)) * view.terrain_cell;
    float range = TILE_SIDES * float(QUADS) * view.terrain_cell * float(step);
    return floor(clamp((length(vec3(p, view.aloof)) / range - 0.7) / 0.25, 0.0, 1.0) * 32.0) * 0.03125;
}

/// The place on the grid coarser than one with this step where a vertex ends.
ivec2 coarser(ivec2 at, int step) {
    return at & ~(2 * step - 1);
}

/// This vertex in eye space, with the ground's slope.
vec3 tile_vertex(out vec2 slope) {
    Tile tile = tiles[gl_InstanceIndex];
    int step = tile.step;
    ivec2 at = tile.corner + ivec2(gl_VertexIndex % (QUADS + 1), gl_VertexIndex / (QUADS + 1)) * step;
    // A tile's far corner may lie where the next level, too, has given way.
    for (int i = 0; i < 2; i++) {
        step = gone(coarser(at, step), step) < 1.0 ? step : step * 2;
        at &= ~(step - 1);
    }
    ivec2 end = coarser(at, step);
    ivec2 base = ivec2(view.nearest);
    vec2 c = mix(vec2(at - base), vec2(end - base), gone(end, step));
    vec3 g = ground(c);
    slope = g.yz;
    vec2 p = view.terrain_origin + c * view.terrain_cell;
    return vec3(p.x, g.x + view.terrain_zero, p.y);
}
