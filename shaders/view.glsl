// What every pass knows of the picture: the camera, the water, the light. Mirrors `View` in
// host/render/src/view.rs.
//
// Space: metres, relative to the camera's eye ("eye space" below keeps the world's axes), so that f32 is
// exact enough anywhere in the world. Add `eye.xyz` for patterns that are fixed in the world.

#define WAVES 8
#define SURFACE_WAVES 12

/// The quality is fixed when a pipeline is made: a software rasteriser runs both sides of a branch, so that
/// what is switched off while it draws would cost as much as what is on.
///
/// No branch, and no loop's end, may hang on uniforms alone: lavapipe compiles a shader with such a branch
/// anew for the values that it finds, as often as the buffer changes, which is every frame. mix() with a bool
/// chooses without a branch.
layout(constant_id = 0) const uint HIGH = 1u;

layout(set = 0, binding = 0, std140) uniform View {
    mat4 clip_from_eye;    // reverse depth: 1 at the near plane, 0 infinitely far away
    vec4 right;            // unit; w: tangent of half the horizontal field of view
    vec4 up;               // unit; w: tangent of half the vertical field of view
    vec4 forward;          // unit; w: distance of the near plane [m]
    vec4 viewport;         // width, height [px], pixels per metre at 1 m, farthest distance that is drawn [m]
    vec4 eye;              // world position of the eye [m]; w: wave number of the sand ripples [rad/m]
    vec4 sun;              // unit vector toward the refracted sun; w: strength of caustics 0..1
    vec4 sun_color;        // just below the surface
    vec4 ambient;          // just below the surface; w: time [s]
    vec4 beam;             // c [1/m]; w: 1 plain background, 0 sea
    vec4 downwelling;      // Kd [1/m]; w: brightness of the picture; 1 is the scene's own
    vec4 scattered;        // W0 at the surface; w: y of the surface [m]
    vec4 plain;            // plain background; w: height of the terrain's sand ripples [m]
    vec4 terrain_origin;   // x, z of the height that `bed` names, relative to the eye [m]; cell [m]; y of height 0 relative to the eye
    vec4 terrain_size;     // columns, rows; 1/extent of the contact map in x, z [1/m]
    vec4 contact_origin;   // x, z of the contact map's first texel relative to the eye [m]; direction of the surge
    vec4 caustic_mean;     // mean gain of the unclamped formula at 1, 2, 4, 8 m below the surface
    vec4 wave[WAVES];      // caustic trains: wave vector x, z [rad/m]; A k^2 [1/m]; phase at the eye [rad]; the long ones first
    vec4 surface[SURFACE_WAVES]; // wave vector x, z [rad/m]; amplitude [m]; phase at the eye [rad]
    vec4 bed;              // mean depth of the bed below the surface [m]; eye over the highest ground or under the lowest [m];
                           // column and row of a height near the eye, may be outside of the field
    vec4 focus[WAVES];     // A k^2 [1/m] times the unit wave vector's x x, z z, x z; A [m]
} view;

/// Whether nothing but what is drawn is shown, before a plain background: for mix().
bvec3 in_diagram() {
    return bvec3(view.beam.w > 0.5);
}

/// How wide a pixel is at a place in eye space [m].
float pixel_at(vec3 p) {
    return max(dot(p, view.forward.xyz), view.forward.w) / view.viewport.z;
}

vec3 sea_light_at(float depth) {
    return exp(-view.downwelling.rgb * max(depth, 0.0));
}

/// Distance below the surface of a point in eye space [m].
float depth_of(vec3 p) {
    return view.scattered.w - view.eye.y - p.y;
}

/// The view ray through a pixel's centre; its length along `forward` is 1.
vec3 pixel_ray(vec2 pixel) {
    vec2 ndc = pixel / view.viewport.xy * 2.0 - 1.0;
    return view.forward.xyz + view.right.xyz * (ndc.x * view.right.w) - view.up.xyz * (ndc.y * view.up.w);
}
