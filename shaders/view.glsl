// What every pass knows of the picture: the camera, the water, the light. Mirrors `View` in
// host/render/src/view.rs.
//
// Space: metres, relative to the camera's eye ("eye space" below keeps the world's axes), so that f32 is
// exact enough anywhere in the world. Add `eye` for patterns that are fixed in the world.

#include "shared.glsl"

/// The quality is fixed when a pipeline is made: a software rasteriser runs both sides of a branch, so that
/// what is switched off while it draws would cost as much as what is on.
///
/// No branch, and no loop's end, may hang on uniforms alone: lavapipe compiles a shader with such a branch
/// anew for the values that it finds, as often as the buffer changes, which is every frame. mix() with a bool
/// chooses without a branch.
layout(constant_id = 0) const uint HIGH = 1u;

/// A train of waves that focuses light.
struct CausticTrain {
    vec2 vector;           // wave vector x, z [rad/m]
    float power;           // A k^2 [1/m]
    float phase;           // at the eye [rad]
    vec3 hessian;          // A k^2 times the unit wave vector's x x, z z, x z [1/m]
    float amplitude;       // A [m]
};

/// A train of the surface as it is seen.
struct SurfaceTrain {
    vec2 vector;           // wave vector x, z [rad/m]
    float amplitude;       // [m]
    float phase;           // at the eye [rad]
};

layout(set = 0, binding = 0, scalar) uniform View {
    mat4 clip_from_eye;    // reverse depth: 1 at the near plane, 0 infinitely far away
    vec3 right;            // unit
    float tangent_x;       // of half the horizontal field of view
    vec3 up;               // unit
    float tangent_y;       // of half the vertical field of view
    vec3 forward;          // unit
    float near;            // distance of the near plane [m]
    vec2 size;             // of the picture [px]
    float pixels_per_metre; // at a distance of 1 m
    float far;             // farthest distance that is drawn [m]
    vec3 eye;              // its place in the world [m]
    float ripple_number;   // wave number of the sand's ripples [rad/m]
    float ripple_height;   // of the sand's ripples [m]
    vec2 surge;            // unit: along which the surge goes, x and z
    vec3 sun;              // unit: toward the refracted sun
    float caustics;        // their strength, 0..1
    vec3 sun_color;        // just below the surface
    vec3 ambient;          // just below the surface
    vec3 beam;             // c [1/m]
    float diagram;         // 1: a plain background, 0: the sea
    vec3 downwelling;      // Kd [1/m]
    float exposure;        // brightness of the picture; 1 is the scene's own
    vec3 scattered;        // W0 at the surface
    float surface_height;  // y of the surface [m]
    vec3 plain;            // the plain background
    vec2 terrain_origin;   // x, z of the height that `nearest` names, relative to the eye [m]
    float terrain_cell;    // [m]
    float terrain_zero;    // y of height 0 relative to the eye [m]
    vec2 terrain_size;     // columns and rows
    vec2 contact_scale;    // 1 over the extent of the contact map in x, z [1/m]
    vec2 contact_origin;   // x, z of the contact map's first texel relative to the eye [m]
    float bed_depth;       // mean depth of the bed below the surface [m]
    float aloof;           // how far the eye is over the highest ground or under the lowest [m]
    vec2 nearest;          // column and row of a height near the eye, may be outside of the field
    vec4 caustic_mean;     // mean gain of the unclamped formula at 1, 2, 4, 8 m below the surface
    CausticTrain caustic[WAVES]; // the long ones first
    SurfaceTrain surface[SURFACE_WAVES];
} view;

/// Whether nothing but what is drawn is shown, before a plain background: for mix().
bvec3 in_diagram() {
    return bvec3(view.diagram > 0.5);
}

/// How wide a pixel is at a place in eye space [m].
float pixel_at(vec3 p) {
    return max(dot(p, view.forward), view.near) / view.pixels_per_metre;
}

vec3 sea_light_at(float depth) {
    return exp(-view.downwelling * max(depth, 0.0));
}

/// Distance below the surface of a point in eye space [m].
float depth_of(vec3 p) {
    return view.surface_height - view.eye.y - p.y;
}

/// The view ray through a pixel's centre; its length along `forward` is 1.
vec3 pixel_ray(vec2 pixel) {
    vec2 ndc = pixel / view.size * 2.0 - 1.0;
    return view.forward + view.right * (ndc.x * view.tangent_x) - view.up * (ndc.y * view.tangent_y);
}
