// Light on a surface under water: the sun through waves, and the soft light from everywhere above.

/// What falls on a surface from all sides: bright water above, lit sand below.
vec3 ambient_light(vec3 normal, vec3 sea_light, vec3 ground) {
    float up = normal.y * 0.5 + 0.5;
    vec3 water = mix(vec3(1.0), view.scattered / max(max(view.scattered.r, view.scattered.g), view.scattered.b), 0.35);
    return view.ambient * sea_light * mix(ground * 0.8, water, up);
}

const vec3 SAND_LIGHT = vec3(0.850, 0.645, 0.385);
const vec3 SAND_DARK = vec3(0.560, 0.400, 0.215);
