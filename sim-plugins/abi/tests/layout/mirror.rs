//! The mirror's layout as Rust sees it.

use std::{fmt::Write, mem::offset_of};

use reef_abi::*;

use crate::Place;

pub struct Struct {
    pub name: &'static str,
    pub size: usize,
    pub align: usize,
    pub fields: Vec<(&'static str, Place)>,
}

/// Size and alignment of the field that a function picks.
fn measure<S, F>(_: fn(&S) -> &F) -> (usize, usize) {
    (size_of::<F>(), align_of::<F>())
}

macro_rules! structs {
    ($($c_name:literal $name:ident { $($field:ident),+ $(,)? })+) => {
        vec![$(Struct {
            name: $c_name,
            size: size_of::<$name>(),
            align: align_of::<$name>(),
            fields: vec![$({
                let (size, align) = measure::<$name, _>(|s| &s.$field);
                (stringify!($field), (offset_of!($name, $field), size, align))
            }),+],
        }),+]
    };
}

/// All structs of the mirror.
pub fn structs() -> Vec<Struct> {
    structs! {
        "reef_object" Object { id, parent, origin, bounds_center, bounds_radius, flags, spare }
        "reef_material" Material { base, tip, accent, pattern, texture, pattern_scale, pattern_softness, translucency, wrap, rim, glow, roughness, specular, spare }
        "reef_fibre" Fibre { object, first_node, node_count, material, flags, sides, variation, flatness, normal, spare }
        "reef_fibre_node" FibreNode { position, radius }
        "reef_joint" Joint { rotation, translation, scale }
        "reef_skinned" Skinned { object, mesh, material, flags, first_joint, joint_count, scale, phase, hue, value, fade, spare }
        "reef_billboard" Billboard { position, size, axis, opacity, velocity, roll, object, texture, color, flags }
        "reef_mesh_draw" MeshDraw { object, mesh, material, flags, first_vertex, vertex_count, phase, hue, value, fade, spare }
        "reef_draw_vertex" DrawVertex { position, normal, thickness }
        "reef_flow" Flow { owner, kind, flags, position, axis, strength, peak, core, reach, fade, modulation, phase, wave_vector, gradient, level, spare }
        "reef_actor" Actor { id, parent, position, velocity, radius, forward, species, flags, spare }
        "reef_debug_line" DebugLine { from, delta, color, channel, spare }
        "reef_trace" Trace { object, position, radius, node, kind, spare }
        "reef_camera" Camera { position, rotation, fov_y, near_plane, far_plane, width, height, spare }
        "reef_water" Water { density, viscosity, depth, spare }
        "reef_wave" Wave { amplitude, wave_number, frequency, phase, direction, spare }
        "reef_heightfield" Heightfield { heights, origin, cell, columns, rows, spare }
        "reef_obstacle" Obstacle { id, from, delta, radius }
        "reef_event" Event { kind, param, object, value, point, spare }
        "reef_step" Step { size, flags, step, time, dt, seed, simd_level, flow_count, wave_count, actor_count, obstacle_count, event_count, camera, water, heightfield, flow, waves, actors, obstacles, events }
        "reef_output" Output { size, spare, ctx, reserve, commit }
        "reef_flow_query" FlowQuery { x, y, z, vx, vy, vz, origin, owner, owners, count, spare }
        "reef_mesh_vertex" MeshVertex { position, normal, uv, thickness, glow, color, spare }
        "reef_mesh_level" MeshLevel { first_index, index_count, first_vertex, vertex_count, error, influences, spare }
        "reef_mesh" Mesh { name, vertices, indices, levels, rest, joints, weights, vertex_count, index_count, level_count, joint_count, influences, flags, spare }
        "reef_texture" Texture { texels, format, width, height, spare, name }
        "reef_host" Host { size, version, ctx, worker_count, spare, log, set_error, should_stop, parallel_for, scratch, sample_flow, mesh_create, mesh_destroy, texture_create, texture_destroy, figure, asset_read, get_extension }
        "reef_limits" Limits { size, stream_count, streams, state_bytes, scratch_bytes, textures, meshes }
        "reef_param" Param { id, kind, flags, choice_count, minimum, maximum, default_value, key, label, group, unit, help, choices, spare }
        "reef_writer" Writer { size, spare, ctx, write, expect }
        "reef_reader" Reader { size, state_version, ctx, read, length }
        "reef_instance" Instance { size, spare, ctx, destroy, reset, step, save_state, load_state, get_param, get_extension }
        "reef_descriptor" Descriptor { size, flags, id, name, version, vendor, description, config_schema, params, param_count, state_version, state_min_version, spare, create, traces, trace_count, spare_traces }
        "reef_entry" Entry { magic, size, version, header_hash, descriptor_count, spare, descriptors, open, close }
    }
}

macro_rules! constants {
    ($($name:ident),+ $(,)?) => {
        vec![$((stringify!($name), i128::from($name) as u64)),+]
    };
}

/// All constants of the mirror; negative ones as their two's complement.
pub fn constants() -> Vec<(&'static str, u64)> {
    constants![
        MAGIC,
        VERSION_MAJOR,
        VERSION_MINOR,
        VERSION,
        HEADER_HASH,
        OK,
        SLEEP,
        DISCARD,
        ERROR,
        FATAL,
        UNSUPPORTED,
        BAD_STATE,
        NO_SPACE,
        BAD_INPUT,
        LOG_ERROR,
        LOG_WARN,
        LOG_INFO,
        LOG_DEBUG,
        SIMD_SCALAR,
        SIMD_SSE4_2,
        SIMD_AVX2,
        SIMD_AVX512,
        STREAM_OBJECT,
        STREAM_MATERIAL,
        STREAM_FIBRE,
        STREAM_FIBRE_NODE,
        STREAM_SKINNED,
        STREAM_JOINT,
        STREAM_MESH_DRAW,
        STREAM_DRAW_VERTEX,
        STREAM_BILLBOARD,
        STREAM_FLOW,
        STREAM_ACTOR,
        STREAM_DEBUG_LINE,
        STREAM_TRACE,
        STREAM_COUNT,
        FLAG_NO_BLEND,
        GREATEST_ID,
        PATTERN_NONE,
        PATTERN_SPOTS,
        PATTERN_BANDS,
        PATTERN_STRIPES,
        PATTERN_BLOTCHES,
        FIBRE_CAP,
        FIBRE_BLADE,
        BILLBOARD_FACING,
        FLOW_SOURCE,
        FLOW_HOLE,
        FLOW_WHIRLWIND,
        FLOW_DIRECTIONAL,
        FLOW_SHELTER,
        EVENT_PARAM,
        EVENT_POKE,
        STEP_TRIAL,
        STEP_TRACE,
        STEP_DEBUG,
        STEP_UNSEEN,
        MESH_DUAL,
        MESH_TWO_SIDED,
        MESH_CUT_OUT,
        TEXTURE_RGBA8_SRGB,
        TEXTURE_RGBA8,
        PARAM_FLOAT,
        PARAM_INT,
        PARAM_SWITCH,
        PARAM_CHOICE,
        PARAM_LOG,
    ]
}

/// What the C program prints, made from the mirror: one line a constant, struct and field.
pub fn report() -> String {
    let mut text = String::new();
    for (name, value) in constants() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "REEF_{name} {value}");
    }
    for s in structs() {
        let _ = writeln!(text, "{} {} {}", s.name, s.size, s.align);
        for (field, (offset, size, align)) in s.fields {
            let _ = writeln!(text, "{}.{field} {offset} {size} {align}", s.name);
        }
    }
    text
}
