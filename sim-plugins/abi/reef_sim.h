/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * reef_sim.h — the contract between the Reef host and a simulation plugin, version 0.2.
 *
 * A plugin is a dynamic library with one exported data symbol, `reef_sim_entry`. The host reads magic, version and
 * header hash from it before it runs any of the library's code, then calls open(), reads the descriptors, makes
 * instances with create() and calls step() once per simulation step. Nothing else is looked up by name.
 *
 * Conventions
 *   Units      metres, seconds, kilograms, radians; y up, still water at y = 0; right-handed.
 *   Positions  f64 origins, f32 offsets from them: an f32 world position would lose millimetres at 20 m.
 *   Strings    UTF-8. `const char *` alone is NUL-terminated and valid until close(); (pointer, length) pairs are not
 *              NUL-terminated and valid during the call. The receiver copies what it keeps. NULL only where [opt].
 *   Arrays     The pointer of an array of 0 elements is not read: it may be anything. A count of 0 says that there is none.
 *   Memory     Never crosses: what one side allocated, that side frees. The host owns every output.
 *   Unwinding  No exception, panic or longjmp crosses the boundary in either direction.
 *   Pointers   Everything reachable from a step's input is valid during that step only.
 *
 * Where a function may be called
 *   [control]  one at a time, on the generation's own control thread
 *   [step]     during step(): one at a time per instance, on any thread of the generation. Instances may step at the same time,
 *              those of one library, too: what they share has to allow it
 *   [job]      concurrently, from a job of parallel_for
 *   [any]      anywhere on a thread of the generation
 * No plugin code, constructors included, ever runs on the program's main thread. Plugins never start threads.
 *
 * How the contract grows
 *   Singletons      (reef_host, reef_descriptor, reef_instance, reef_step, reef_output, reef_writer, reef_reader) begin with
 *                   `uint32_t size` and only ever get fields appended. A reader takes min(size, sizeof) bytes and treats the
 *                   rest as zero; a writer never writes past the caller's size. REEF_HAS says whether a field is there.
 *                   reef_entry is one, too, but begins with the magic number by which it is known.
 *   Array elements  (everything else) are frozen. A new layout is a new stream id.
 *   Spare fields    of everything are zero, and so is a `flags` in which no bit has a meaning: the host refuses what is not.
 *   Constants       A flag, kind, pattern, format or stream of version x.y is used where host->version is x.y or more. Whoever
 *                   reads skips kinds and ignores flags that it does not know; the host says once that it met one. A service
 *                   that does not know what it is asked for answers REEF_UNSUPPORTED, and the step goes on.
 *   Extensions      What is not proven yet is asked for by name: get_extension(id) of reef_host and of reef_instance gives a table,
 *                   or NULL where the other side does not have it. Ids begin with `draft/` until the contract takes what they
 *                   name up as fields of its own; then the draft stays for one minor version.
 *   Retired         What is to go is named here with the version from which on it is gone, one minor version before.
 *   Flags           Bits 0 to 7 mean the same in every `flags`; those of one struct alone begin at bit 8 (256).
 *   While the major version is 0, REEF_HEADER_HASH must match, too: any difference is refused by name.
 *
 * Before it is included, REEF_EXPORT may be defined, and REEF_NO_ASSERTS leaves the assertions of layouts out: for translators
 * to other languages.
 */
#ifndef REEF_SIM_H
#define REEF_SIM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* "REEFSIM\0", read as a little-endian integer. */
#define REEF_MAGIC 0x004d495346454552ull
#define REEF_VERSION_MAJOR 0u
#define REEF_VERSION_MINOR 2u
#define REEF_VERSION 0x00000002u /* major << 16 | minor */
/* FNV-1a (64 bits) over this file's bytes without its one line that defines REEF_HEADER_HASH. A test keeps it true. */
#define REEF_HEADER_HASH 0x3c6a79609c2da18dull

#if defined(REEF_EXPORT)
#elif defined(_WIN32)
#define REEF_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define REEF_EXPORT __attribute__((visibility("default")))
#else
#define REEF_EXPORT
#endif

/* Whether the other side filled the field of a singleton that `table` points to: REEF_HAS(host, figure). What is not there is not
 * read. A service that is there may still be NULL where this contract says [opt]. */
#define REEF_HAS(table, field) \
  ((table)->size >= (uint32_t)((const char *)&(table)->field - (const char *)(table)) + (uint32_t)sizeof((table)->field))

/* ------------------------------------------------------------------------------------------------ status values
 * Each says in what state the instance is left. Every failure carries a message: call reef_host.set_error first.
 * Whose fault a failed step is: ERROR, UNSUPPORTED, NO_SPACE, BAD_STATE and BAD_INPUT stop this instance, until reset() or
 * load_state(); FATAL, any other number, and outputs that break a rule are the library's, which the host rolls back. */
#define REEF_OK 0           /* done; the outputs count */
#define REEF_SLEEP 1        /* nothing changed since the last step: the last outputs stay, flow and actors included. After create(),
                               reset() and load_state() there are none yet: the first step emits */
#define REEF_DISCARD 2      /* this step is refused, the state is untouched; the last good outputs stay. Its events are not given again:
                               a parameter whose event was in it keeps its value from before */
#define REEF_ERROR -1       /* the instance needs reset() or load_state() */
#define REEF_FATAL -2       /* the library is at fault (a caught panic, say) */
#define REEF_UNSUPPORTED -3 /* not known to this host, or not taken by it; nothing came of the call, and the step goes on */
#define REEF_BAD_STATE -4 /* load_state: not readable; the instance is untouched */
#define REEF_NO_SPACE -5  /* a limit of the host is reached; the message names it */
#define REEF_BAD_INPUT -6 /* create: the configuration is wrong; the message names the JSON path */

#define REEF_LOG_ERROR 1u
#define REEF_LOG_WARN 2u
#define REEF_LOG_INFO 3u
#define REEF_LOG_DEBUG 4u

/* Instruction sets that a plugin may use in a step (reef_step.simd_level). All give the same bytes. */
#define REEF_SIMD_SCALAR 0u
#define REEF_SIMD_SSE4_2 1u /* or NEON */
#define REEF_SIMD_AVX2 2u   /* with FMA */
#define REEF_SIMD_AVX512 3u

/* ------------------------------------------------------------------------------------------------------ streams
 * What a step emits. reserve() memory in a stream, write elements, commit() how many count. A stream that is not
 * committed in a step that returned REEF_OK is empty in that step, whichever it is.
 * Elements refer to others by index into the same step's streams of the same instance. */
#define REEF_STREAM_OBJECT 1u      /* reef_object: one anemone, plant, fish, box; what everything below belongs to */
#define REEF_STREAM_MATERIAL 2u    /* reef_material: how surfaces look */
#define REEF_STREAM_FIBRE 3u       /* reef_fibre: a node chain with radii */
#define REEF_STREAM_FIBRE_NODE 4u  /* reef_fibre_node */
#define REEF_STREAM_SKINNED 5u     /* reef_skinned: a mesh uploaded once, moved by joints */
#define REEF_STREAM_JOINT 6u       /* reef_joint */
#define REEF_STREAM_MESH_DRAW 7u   /* reef_mesh_draw: a mesh uploaded once, with vertices made anew */
#define REEF_STREAM_DRAW_VERTEX 8u /* reef_draw_vertex */
#define REEF_STREAM_BILLBOARD 9u   /* reef_billboard */
#define REEF_STREAM_FLOW 10u       /* reef_flow: what this instance does to the water, felt in the next step */
#define REEF_STREAM_ACTOR 11u      /* reef_actor: what others may perceive, follow, avoid, pick, in the next step */
#define REEF_STREAM_DEBUG_LINE 12u /* reef_debug_line, when reef_step.flags has REEF_STEP_DEBUG */
#define REEF_STREAM_TRACE 13u      /* reef_trace, when reef_step.flags has REEF_STEP_TRACE; recordings read it alone */
#define REEF_STREAM_COUNT 14u

/* Common bits of all flags (0 to 7): do not blend with the step before (it jumped or wrapped). */
#define REEF_FLAG_NO_BLEND 1u

/* One thing in the sea. The renderer matches objects of two steps by id. 64 bytes.
 * Ids are 1 to REEF_GREATEST_ID. To other modules an object has that id with the tag of its module in the 16 bits above, which follows
 * from the module's name in the scene: so it may be kept over steps and saves. Ids of strangers go where `parent` is, and nowhere else. */
#define REEF_GREATEST_ID 0xffffffffffffull
typedef struct reef_object {
  uint64_t id;             /* stable over steps, reloads and saves; unique within the instance */
  uint64_t parent;         /* id of the object that it rides on, 0: none; the checker alone reads it */
  double origin[3];        /* [m] world position that the elements' f32 positions are relative to */
  float bounds_center[3];  /* [m] bounding sphere, relative to origin: the renderer leaves out what is not in view, and people
                              who point at the sea hit it */
  float bounds_radius;     /* [m] >= 0 */
  uint32_t flags;          /* REEF_FLAG_* */
  uint32_t spare;
} reef_object;

/* How a surface looks. Colours are linear RGB, 0..1. 128 bytes. */
#define REEF_PATTERN_NONE 0u
#define REEF_PATTERN_SPOTS 1u    /* round spots of accent */
#define REEF_PATTERN_BANDS 2u    /* rings around the fibre */
#define REEF_PATTERN_STRIPES 3u  /* lines along the fibre */
#define REEF_PATTERN_BLOTCHES 4u /* irregular patches */
typedef struct reef_material {
  float base[4];         /* colour at the root; [3]: opacity */
  float tip[4];          /* colour at the tip; [3]: where the tip's colour begins along the fibre, 0..1 */
  float accent[4];       /* colour of the pattern; [3]: its share of the surface, 0..1 */
  uint32_t pattern;      /* REEF_PATTERN_* */
  uint32_t texture;      /* id from texture_create, 0: none */
  float pattern_scale;   /* [1/m] for spots and blotches; rings or stripes in all for bands and stripes */
  float pattern_softness;/* 0 hard .. 1 soft edge */
  float translucency;    /* 0 opaque .. 1 light shines through with exp(-2 thickness/cm) */
  float wrap;            /* 0 Lambert .. 1 light wraps round */
  float rim;             /* strength of the rim light */
  float glow;            /* emitted light at the tip; 0 by day */
  float roughness;       /* 0 mirror .. 1 matt */
  float specular;        /* reflectance at normal incidence under water: .0003 tissue, .008 rock */
  float spare[10];
} reef_material;

/* A node chain, root first, skinned by the renderer as a generalised cylinder (the paper's §3.2). 64 bytes. */
#define REEF_FIBRE_CAP 256u   /* flags: close the end with a disc that carries things (an anemone's mouth) */
#define REEF_FIBRE_BLADE 512u /* flags: a flat blade, a radius wide to both sides along `normal`; `flatness`: thickness over width */
typedef struct reef_fibre {
  uint32_t object;      /* index into the object stream */
  uint32_t first_node;  /* index into the node stream */
  uint32_t node_count;  /* >= 2 */
  uint32_t material;    /* index into the material stream */
  uint32_t flags;       /* REEF_FLAG_*, REEF_FIBRE_* */
  uint32_t sides;       /* vertices of a ring at full detail, 3..64 */
  uint32_t variation;   /* a hash: small differences of hue between neighbours */
  float flatness;       /* 1 round; below 1 with REEF_FIBRE_BLADE */
  float normal[3];      /* unit vector across the first segment: angle 0 of the first ring; carried along without twist */
  float spare[5];
} reef_fibre;

typedef struct reef_fibre_node {
  float position[3];    /* [m] relative to the object's origin */
  float radius;         /* [m] > 0 */
} reef_fibre_node;

/* Where a joint stands: x in the joint's own frame is translation + scale * rotate(rotation, x). 32 bytes.
 * Joints are rigid frames, one a section, rather than points. A body of seven sections is 224 bytes a step, its corners as points
 * would be 368, and a frame turns normals without a rule of its own. */
typedef struct reef_joint {
  float rotation[4];    /* unit quaternion x, y, z, w */
  float translation[3]; /* [m] relative to the object's origin; of a mesh at rest: in the mesh's space */
  float scale;          /* > 0 */
} reef_joint;

/* An instance of a mesh that was uploaded once (reef_host.mesh_create), moved by joints. 64 bytes.
 * T_j = joint_j * inverse(rest_j) moves a vertex v at rest, weight w_j:
 *   linear  p = sum w_j T_j(v), n = unit(sum w_j s_j R_j n): cheap, thinner where joints twist
 *   dual    REEF_MESH_DUAL: the T_j as unit dual quaternions, turned to the first one's side, summed with w_j, made unit again; their
 *           scales are blended beside them and applied first. Twists keep their thickness.
 * One joint moves any mesh as a whole: T = joint_0, and `rest` is not read. So what is far costs one joint.
 * Between two steps joints are blended one by one: translation and scale along a line, rotation along the shorter arc. The element of
 * the step before is the one with the same number among the elements of the object with the same id; where that has another mesh or
 * another joint_count, or with REEF_FLAG_NO_BLEND, nothing is blended. Elements may share joints. */
typedef struct reef_skinned {
  uint32_t object;      /* index into the object stream */
  uint32_t mesh;        /* id from mesh_create */
  uint32_t material;    /* index into the material stream; along a mesh "root to tip" is uv[1], "around" is uv[0] */
  uint32_t flags;       /* REEF_FLAG_* */
  uint32_t first_joint; /* index into the joint stream */
  uint32_t joint_count; /* the mesh's own number, or 1 */
  float scale;          /* > 0: the mesh at rest is so many times as large */
  float phase;          /* patterns are moved on by it: bands and stripes by that share of their period, 0..1 */
  float hue;            /* [rad] turns the colours' hue, -pi..pi */
  float value;          /* colours * (1 + value), -1..4 */
  float fade;           /* 0: there .. 1: gone; between, a share of the pixels */
  uint32_t spare[5];
} reef_skinned;

/* A sprite. It brings its own velocity, so that the picture between two steps needs the newer one alone: sprites have no
 * identity, and a step emits those that may be seen, in any order that is the same for every run. 64 bytes. */
#define REEF_BILLBOARD_FACING 256u /* flags: turned to the viewer; else it lies across `axis` */
typedef struct reef_billboard {
  float position[3];    /* [m] at the end of the step, relative to the object's origin */
  float size;           /* [m] diameter > 0 */
  float axis[3];        /* unit normal of the sprite; not read with REEF_BILLBOARD_FACING */
  float opacity;        /* 0..1 */
  float velocity[3];    /* [m/s] of this step: earlier by t the sprite is shown at position - velocity t. With
                           REEF_FLAG_NO_BLEND it is not read, and the sprite stands at its position */
  float roll;           /* [rad] the picture's turn about the sprite's normal */
  uint32_t object;      /* index into the object stream */
  uint32_t texture;     /* id from texture_create; 0: a soft round dot */
  uint32_t color;       /* sRGB 0xAABBGGRR, multiplies the texture */
  uint32_t flags;       /* REEF_FLAG_*, REEF_BILLBOARD_* */
} reef_billboard;

/* An instance of an uploaded mesh whose vertices are made anew: the mesh gives indices, levels, uv, colour and glow, the stream
 * positions, normals and thickness. 48 bytes.
 * No two elements share a vertex. Identity from step to step is as for reef_skinned: the same
 * mesh and number within the object with the same id; then positions, normals and thickness are blended vertex by vertex. */
typedef struct reef_mesh_draw {
  uint32_t object;
  uint32_t mesh;        /* id from mesh_create */
  uint32_t material;
  uint32_t flags;       /* REEF_FLAG_* */
  uint32_t first_vertex;/* index into the draw vertex stream */
  uint32_t vertex_count;/* the mesh's own number */
  float phase;          /* as in reef_skinned */
  float hue;
  float value;
  float fade;
  uint32_t spare[2];
} reef_mesh_draw;

/* 20 bytes. */
typedef struct reef_draw_vertex {
  float position[3];    /* [m] relative to the object's origin */
  uint32_t normal;      /* as in reef_mesh_vertex */
  float thickness;      /* [m] >= 0 */
} reef_draw_vertex;

/* One primitive of the sea's flow field. V(p) = sum of all; shelters then multiply. 128 bytes.
 * Local kinds (Aliaga & Larboulette 2009, eq. 2-4), d = |p - C|:
 *   source     sign * |F| / (|F|/F_max + d^2) * unit(p - C)         F < 0 is a hole
 *   whirlwind  sign * |F| / (|F|/F_max + d^2) * unit((p - C) x R)
 * Global kind (eq. 5):
 *   directional  F * (1 - m + m sin(phase + k.p)) * max(0, 1 + g (y - level)) * v
 *                constant: m = 0; sine in time: m > 0, k = 0; travelling: k > 0; growing with height: g != 0 */
#define REEF_FLOW_SOURCE 1u
#define REEF_FLOW_HOLE 2u       /* a source with the opposite sign */
#define REEF_FLOW_WHIRLWIND 3u
#define REEF_FLOW_DIRECTIONAL 4u
#define REEF_FLOW_SHELTER 5u    /* multiplies the velocity by 1 - strength * fade(d / reach) */
typedef struct reef_flow {
  uint64_t owner;         /* object that emits it; an object does not feel what it emits itself. 0: the scene */
  uint32_t kind;          /* REEF_FLOW_* */
  uint32_t flags;
  double position[3];     /* [m] C */
  float axis[3];          /* R, or the direction v; unit */
  float strength;         /* F [m^3/s] for local kinds, [m/s] for directional, 0..1 for shelter */
  float peak;             /* F_max [m/s] > 0: the speed at the centre */
  float core;             /* [m] >= 0: rounds the jump of direction at the centre; 0: as printed */
  float reach;            /* [m] the field is exactly 0 beyond it; 0: unlimited */
  float fade;             /* 0..1: share of reach from which on it fades smoothly to 0 */
  float modulation;       /* m, 0..1 */
  float phase;            /* [rad] reduced modulo 2 pi by who emits it */
  float wave_vector[3];   /* k [rad/m] */
  float gradient;         /* g [1/m] */
  float level;            /* [m] y at which the factor of height is 1 */
  uint32_t spare[7];
} reef_flow;

/* What others may perceive. 104 bytes. */
typedef struct reef_actor {
  uint64_t id;          /* of an object, or of nothing that is drawn: 1 to REEF_GREATEST_ID for who emits it */
  uint64_t parent;      /* the object that it belongs to, rides on or lives in, one's own or a stranger's; 0: none */
  double position[3];   /* [m] */
  float velocity[3];    /* [m/s] */
  float radius;         /* [m] */
  float forward[3];     /* unit, or zero */
  uint32_t species;     /* FNV-1a (32 bits) of the species' name */
  uint32_t flags;
  uint32_t spare[7];
} reef_actor;

/* 48 bytes. */
typedef struct reef_debug_line {
  double from[3];       /* [m] */
  float delta[3];       /* [m] to - from */
  uint32_t color;       /* sRGB 0xAABBGGRR */
  uint32_t channel;     /* groups that the panel switches, 0..31 */
  uint32_t spare;
} reef_debug_line;

/* 48 bytes. */
typedef struct reef_trace {
  uint64_t object;      /* number of the plant, animal or fibre in the recording, from 0 */
  double position[3];   /* [m] */
  float radius;         /* [m] */
  uint32_t node;
  uint32_t kind;        /* index into the descriptor's `traces` */
  uint32_t spare;
} reef_trace;

/* ------------------------------------------------------------------------------------------------- step's input */

/* The scene's camera with its nominal viewport, never the window's. 72 bytes. */
typedef struct reef_camera {
  double position[3];   /* [m] */
  float rotation[4];    /* unit quaternion x, y, z, w; looks along -z, y up */
  float fov_y;          /* [rad] */
  float near_plane;     /* [m] */
  float far_plane;      /* [m] */
  uint32_t width;       /* [px] nominal */
  uint32_t height;      /* [px] nominal */
  uint32_t spare[3];
} reef_camera;

typedef struct reef_water {
  float density;        /* rho [kg/m^3] */
  float viscosity;      /* mu [Pa s], dynamic */
  float depth;          /* h [m] > 0: the bed is at y = -h */
  float spare[5];
} reef_water;

/* One wave train (Coulais et al. 2005, §3): eta = r sin(k (x cos(theta) + z sin(theta)) - omega t + phase). 32 bytes. */
typedef struct reef_wave {
  float amplitude;      /* r [m] */
  float wave_number;    /* k [rad/m] */
  float frequency;      /* omega [rad/s] */
  float phase;          /* [rad] of this step: random phase - omega t, reduced modulo 2 pi in f64 by the host */
  float direction[2];   /* cos(theta), sin(theta): along x and z */
  float spare[2];
} reef_wave;

/* Heights y of the sea bed at origin + (column, row) * cell, bilinear between. 40 bytes. */
typedef struct reef_heightfield {
  const float *heights; /* rows * columns, row after row (z), column (x) fastest */
  double origin[2];     /* [m] x, z */
  float cell;           /* [m] */
  uint32_t columns;
  uint32_t rows;
  uint32_t spare;
} reef_heightfield;

/* A capsule that nothing should enter. 48 bytes. */
typedef struct reef_obstacle {
  uint64_t id;
  double from[3];       /* [m] */
  float delta[3];       /* [m] to - from */
  float radius;         /* [m] */
} reef_obstacle;

/* What came from outside in this step, in the journal's order. 64 bytes. */
#define REEF_EVENT_PARAM 1u /* the parameter `param` is now `value` */
#define REEF_EVENT_POKE 2u  /* somebody touched the sea at `point`, at a speed of `value` [m/s]; object: what was hit, by the id that its
                               module gave it where that is this one, or 0 */
typedef struct reef_event {
  uint32_t kind;
  uint32_t param;       /* reef_param.id */
  uint64_t object;
  double value;
  double point[3];      /* [m] */
  uint32_t spare[4];
} reef_event;

#define REEF_STEP_TRIAL 256u  /* on the side, before a swap: outputs are checked and thrown away */
#define REEF_STEP_TRACE 512u  /* emit the trace stream; dt = 0 with it: only emit, do not advance */
#define REEF_STEP_DEBUG 1024u /* emit debug lines */
#define REEF_STEP_UNSEEN 2048u /* nobody looks at this step: what only shows may stay out of the streams. Where objects are, flow, actors,
                                 what is asked for, and the state after the step are those of a step that is seen. The first
                                 step that is seen again emits all: it does not return REEF_SLEEP where something was left out */
typedef struct reef_step {
  uint32_t size;
  uint32_t flags;                      /* REEF_STEP_* */
  uint64_t step;                       /* number of this step, from 1; 0: the state before the first */
  double time;                         /* [s] at the end of this step */
  double dt;                           /* [s]; 0: emit the present state, change nothing */
  uint64_t seed;
  uint32_t simd_level;                 /* REEF_SIMD_* */
  uint32_t flow_count;
  uint32_t wave_count;
  uint32_t actor_count;
  uint32_t obstacle_count;
  uint32_t event_count;
  const reef_camera *camera;
  const reef_water *water;
  const reef_heightfield *heightfield; /* [opt] */
  const reef_flow *flow;               /* the scene's, then what plugins emitted in the step before, in fixed order */
  const reef_wave *waves;              /* sorted by amplitude, greatest first */
  const reef_actor *actors;
  const reef_obstacle *obstacles;
  const reef_event *events;
} reef_step;

/* ------------------------------------------------------------------------------------------------- step's output */
typedef struct reef_output {
  uint32_t size;
  uint32_t spare;
  void *ctx;
  /* Room for `count` elements of the stream. May move what was reserved in it before: reserve before parallel_for,
   * then write disjoint ranges. elem_size must be the sizeof of the stream's element; what the room holds at first is
   * arbitrary, but initialised. [step] */
  int32_t (*reserve)(void *ctx, uint32_t stream, uint32_t elem_size, uint64_t count, void **out);
  /* The first `count` reserved elements count. [step] */
  int32_t (*commit)(void *ctx, uint32_t stream, uint64_t count);
} reef_output;

/* ------------------------------------------------------------------------------------------------- host services */
typedef void (*reef_job)(void *user, uint32_t index, uint32_t worker);

/* Velocities of the sea at many points (arrays of `count`). 96 bytes. */
typedef struct reef_flow_query {
  const float *x, *y, *z;  /* [m] relative to origin */
  float *vx, *vy, *vz;     /* [m/s] */
  double origin[3];        /* [m] */
  uint64_t owner;          /* leave out what this object emits; 0: nothing */
  const uint64_t *owners;  /* [opt] a point each, in place of `owner`; best in runs of the same */
  uint32_t count;
  uint32_t spare;
} reef_flow_query;

/* A vertex of a mesh at rest. 40 bytes.
 * normal: a unit vector (x, y, z) on an octahedron. d = |x| + |y| + |z|; (a, b) = (x, y) / d, and where z < 0 it is
 * ((1 - |y| / d) * sign(x), (1 - |x| / d) * sign(y)) with sign(0) = 1. The low 16 bits are round(32767 a) as a two's complement, the high
 * ones round(32767 b). Every value is a unit vector. */
typedef struct reef_mesh_vertex {
  float position[3];    /* [m] */
  uint32_t normal;
  float uv[2];          /* u around, v from root (0) to tip (1), -100..100; textures lie over 0..1, and again and again around */
  float thickness;      /* [m] >= 0: tissue that light crosses, for materials with translucency */
  float glow;           /* >= 0, multiplies the material's */
  uint32_t color;       /* sRGB 0xAABBGGRR, multiplies the material's colours; AA: its opacity */
  uint32_t spare;
} reef_mesh_vertex;

/* A level of detail: triangles among some of the mesh's vertices. Levels may share vertices; a step's work grows with
 * vertex_count, so a coarser level's best come first in the mesh. The finer of two levels is chosen where `error` of the coarser one
 * would show; between, a growing share of the pixels is the other's. 32 bytes. */
typedef struct reef_mesh_level {
  uint32_t first_index;
  uint32_t index_count; /* a multiple of 3, > 0 */
  uint32_t first_vertex;/* the triangles' corners lie among the vertices from here on ... */
  uint32_t vertex_count;/* ... which are so many */
  float error;          /* [m] farthest from level 0 at rest; 0 for level 0, growing from level to level */
  uint32_t influences;  /* 0, 1, 2, 4 or 8, not above the mesh's: the greatest so many of each vertex, made to sum to 1 */
  uint32_t spare[2];
} reef_mesh_level;

/* A mesh at rest: read during mesh_create alone. 88 bytes. */
#define REEF_MESH_DUAL 256u      /* flags: joints are blended as dual quaternions; else linearly */
#define REEF_MESH_TWO_SIDED 512u /* flags: seen, and lit, from both sides; else only from where its triangles are counter-clockwise */
#define REEF_MESH_CUT_OUT 1024u  /* flags: where the material's texture is less than half opaque there is nothing; else it hides the colours */
typedef struct reef_mesh {
  const char *name;             /* [opt] for messages */
  const reef_mesh_vertex *vertices;
  const uint32_t *indices;      /* into the mesh's vertices, three a triangle */
  const reef_mesh_level *levels;/* the finest first */
  const reef_joint *rest;       /* [opt] where the joints stand at rest */
  const uint32_t *joints;       /* [opt] `influences` joints a vertex, vertex after vertex */
  const float *weights;         /* [opt] as many: 0..1, those of a vertex sum to 1 within 0.001 */
  uint32_t vertex_count;        /* 1..2^20 */
  uint32_t index_count;         /* 3..2^22 */
  uint32_t level_count;         /* 1..8 */
  uint32_t joint_count;         /* 0..256; 0: for mesh draws, or one joint that moves all */
  uint32_t influences;          /* 0 (without joints), 1, 2, 4 or 8 */
  uint32_t flags;               /* REEF_MESH_* */
  uint32_t spare[2];
} reef_mesh;

/* A picture: red, green, blue, alpha, 8 bits each. 40 bytes. */
#define REEF_TEXTURE_RGBA8_SRGB 1u /* red, green and blue are sRGB, as in PNG files; alpha is straight in both */
#define REEF_TEXTURE_RGBA8 2u      /* all are linear */
typedef struct reef_texture {
  const void *texels;   /* row after row, tightly packed */
  uint32_t format;      /* REEF_TEXTURE_* */
  uint32_t width;       /* 1..1024 */
  uint32_t height;      /* 1..1024 */
  uint32_t spare[3];
  const char *name;     /* [opt] for messages */
} reef_texture;

typedef struct reef_host {
  uint32_t size;
  uint32_t version;      /* REEF_VERSION of the host */
  void *ctx;             /* first argument of all services */
  uint32_t worker_count; /* `worker` of a job is below this */
  uint32_t spare;
  /* [any] */
  void (*log)(void *ctx, uint32_t level, const char *text, uint64_t length);
  /* The message of the failure that is about to be returned. [any] */
  void (*set_error)(void *ctx, const char *text, uint64_t length);
  /* Not 0: the watchdog asks this call to return soon: with REEF_DISCARD where the state is as it was before the step, else with
   * REEF_ERROR. What comes too late is the library's fault. [any] */
  uint32_t (*should_stop)(void *ctx);
  /* Calls job(user, i, worker) for i in 0..count on the host's workers and returns when all are done. A call from a
   * job runs inline. Which worker runs what is not defined: write only what belongs to i. [control] [step] [job] */
  int32_t (*parallel_for)(void *ctx, uint32_t count, reef_job job, void *user);
  /* Memory until the end of this step; align: a power of two up to 4096. [step] */
  int32_t (*scratch)(void *ctx, uint64_t bytes, uint64_t align, void **out);
  /* [step] [job] */
  int32_t (*sample_flow)(void *ctx, const reef_flow_query *query);
  /* A mesh that elements name by its id, as long as it is there. What is made again while it is there (the same name and content)
   * is the same, with the same id, and stays until it was destroyed as often. Ids are 1 and up, in the order of making, and never
   * used for anything else. Reset, load_state and a discarded step leave it; what an instance made goes with it; not in open().
   * [control] [step] */
  int32_t (*mesh_create)(void *ctx, const reef_mesh *mesh, uint32_t *out_id);
  int32_t (*mesh_destroy)(void *ctx, uint32_t id);
  /* A picture that elements name by its id, as for meshes: the same name, format, size and texels are the same. [control] [step] */
  int32_t (*texture_create)(void *ctx, const reef_texture *texture, uint32_t *out_id);
  int32_t (*texture_destroy)(void *ctx, uint32_t id);
  /* A figure for people who look at the module in the panel: what a step saved, how many things are awake. The last value of
   * each name is shown; at most 32 names of at most 64 bytes, what is beyond is not. [any] */
  void (*figure)(void *ctx, const char *name, uint64_t length, double value);
  /* A file of the module's own assets: `name` is its path, with `/`, within the folder that is named like the plugin's id, among the
   * host's assets in `modules/` or beside the library. The bytes stay until this call of the plugin returned. Where a file that was
   * read changes later, the host makes the instance anew, as after an edit of its table in the scene. REEF_BAD_INPUT: there is none,
   * or the name leads out of the folder; REEF_NO_SPACE: more than 64 MiB in a call. Not in open(). [control] */
  int32_t (*asset_read)(void *ctx, const char *name, uint64_t length, const void **out_bytes, uint64_t *out_length);
  /* The table of an extension, which lives as long as this one; NULL: the host does not have it. [any] */
  const void *(*get_extension)(void *ctx, const char *id);
} reef_host;

/* What one instance may have at most, of get_extension(REEF_EXTENSION_LIMITS). */
#define REEF_EXTENSION_LIMITS "draft/limits"
typedef struct reef_limits {
  uint32_t size;
  uint32_t stream_count;   /* streams that the host knows; those from there on it does not take */
  const uint64_t *streams; /* by a stream's number: most elements in a step; 0: the host does not take it */
  uint64_t state_bytes;    /* most of a saved state */
  uint64_t scratch_bytes;  /* most that scratch lends in a step, all together */
  uint32_t textures;       /* most at a time */
  uint32_t meshes;         /* most at a time */
} reef_limits;

/* ------------------------------------------------------------------------------------------------------- plugins */
#define REEF_PARAM_FLOAT 1u
#define REEF_PARAM_INT 2u
#define REEF_PARAM_SWITCH 3u /* 0 or 1 */
#define REEF_PARAM_CHOICE 4u /* 0 .. choice_count - 1 */
#define REEF_PARAM_LOG 256u  /* flags: a logarithmic slider */
typedef struct reef_param {
  uint32_t id;               /* stable for ever; not an index; not 0 */
  uint32_t kind;             /* REEF_PARAM_* */
  uint32_t flags;
  uint32_t choice_count;
  double minimum;
  double maximum;
  double default_value;
  const char *key;           /* in scene files: lower_case_words */
  const char *label;         /* in the panel */
  const char *group;         /* heading in the panel */
  const char *unit;          /* "m/s", "" */
  const char *help;          /* one sentence */
  const char *const *choices;/* [opt] choice_count names */
  uint64_t spare[2];
} reef_param;

/* Where save_state writes and load_state reads. The host wraps the bytes in an envelope of plugin id, state version,
 * length and hash. The payload is the plugin's own, little-endian and without pointers; reef_state.h writes and reads tagged fields,
 * to which a later version may add. */
typedef struct reef_writer {
  uint32_t size;
  uint32_t spare;
  void *ctx;
  int32_t (*write)(void *ctx, const void *bytes, uint64_t length);
  /* So many bytes are still to come, as far as is known: room for them is made at once. Need not be called. */
  int32_t (*expect)(void *ctx, uint64_t length);
} reef_writer;

typedef struct reef_reader {
  uint32_t size;
  uint32_t state_version; /* of the library that wrote the bytes */
  void *ctx;
  /* Copies up to `length` bytes, returns how many; 0 at the end. May return fewer than asked before the end. -1: it cannot read, and
   * load_state returns REEF_BAD_STATE. */
  int64_t (*read)(void *ctx, void *bytes, uint64_t length);
  uint64_t length;        /* of the whole payload */
} reef_reader;

/* Filled by create(), up to the size that the host put there. */
typedef struct reef_instance {
  uint32_t size;
  uint32_t spare;
  void *ctx;             /* first argument of all functions below */
  /* [control] */
  void (*destroy)(void *ctx);
  /* Back to the state after create(), parameters included. [control] */
  int32_t (*reset)(void *ctx);
  /* [step] */
  int32_t (*step)(void *ctx, const reef_step *input, const reef_output *output);
  /* [control] */
  int32_t (*save_state)(void *ctx, const reef_writer *writer);
  /* All or nothing: anything but REEF_OK leaves the instance as it was. A state_version below state_min_version or above
   * state_version is REEF_BAD_STATE. [control] */
  int32_t (*load_state)(void *ctx, const reef_reader *reader);
  /* The parameter's present value. Parameters change through the step's events only. [control] */
  int32_t (*get_param)(void *ctx, uint32_t id, double *out_value);
  /* [opt] The table of an extension, which lives as long as the instance; NULL: it does not have it. [control] */
  const void *(*get_extension)(void *ctx, const char *id);
} reef_instance;

typedef struct reef_descriptor {
  uint32_t size;
  uint32_t flags;
  const char *id;            /* "reef.anemone": reverse-domain or vendor.name; stable */
  const char *name;
  const char *version;       /* of the plugin: "1.2.3" */
  const char *vendor;
  const char *description;
  const char *config_schema; /* [opt] JSON Schema of the module's table in a scene file: what does not fit never gets to create() */
  const reef_param *params;  /* [opt] */
  uint32_t param_count;
  uint32_t state_version;    /* what save_state writes */
  uint32_t state_min_version;/* the oldest that load_state reads */
  uint32_t spare;
  /* config: JSON object {"scene": {"name", "seed", "scale", "dt"}, "species": {NAME: {...}}, "config": {...}}.
   * A scene may count in lengths of its own, of `scale` metres: numbers whose schema names a unit with a length ("x-unit": "m",
   * "m/s", "1/m") come in metres, defaults of the schema included, and so do parameters. Units of matter ("N/m") stay.
   * An error's message begins with the path in "config": `anemones[3].species: ...`.
   * `host` is this instance's own: valid until destroy() returned, or create() returned a failure.
   * [control] */
  int32_t (*create)(const reef_host *host, const char *config, uint64_t length, reef_instance *out);
  const char *const *traces; /* [opt] what its traces are of, as recordings name it: "fibre", "fish"; lower_case_words */
  uint32_t trace_count;      /* at most 16 */
  uint32_t spare_traces;
} reef_descriptor;

typedef struct reef_entry {
  uint64_t magic;            /* REEF_MAGIC */
  uint32_t size;
  uint32_t version;          /* REEF_VERSION */
  uint64_t header_hash;      /* REEF_HEADER_HASH */
  uint32_t descriptor_count; /* 1..64 */
  uint32_t spare;
  const reef_descriptor *const *descriptors;
  /* Once, before anything else; `host` stays valid until close() returns. [control] */
  int32_t (*open)(const reef_host *host);
  /* Once, after every instance is destroyed. [control] */
  void (*close)(void);
} reef_entry;

/* A plugin defines this symbol, which this declaration exports:
 *   const reef_entry reef_sim_entry = { REEF_MAGIC, sizeof(reef_entry), REEF_VERSION, REEF_HEADER_HASH, ... }; */
extern REEF_EXPORT const reef_entry reef_sim_entry;

#ifndef REEF_NO_ASSERTS
#ifdef __cplusplus
#define REEF_ASSERT_LAYOUT(type, bytes, alignment) \
  static_assert(sizeof(type) == bytes && alignof(type) == alignment, "layout of " #type)
#else
#define REEF_ASSERT_LAYOUT(type, bytes, alignment) \
  _Static_assert(sizeof(type) == bytes && _Alignof(type) == alignment, "layout of " #type)
#endif
REEF_ASSERT_LAYOUT(void *, 8, 8);
REEF_ASSERT_LAYOUT(reef_object, 64, 8);
REEF_ASSERT_LAYOUT(reef_material, 128, 4);
REEF_ASSERT_LAYOUT(reef_fibre, 64, 4);
REEF_ASSERT_LAYOUT(reef_fibre_node, 16, 4);
REEF_ASSERT_LAYOUT(reef_skinned, 64, 4);
REEF_ASSERT_LAYOUT(reef_joint, 32, 4);
REEF_ASSERT_LAYOUT(reef_billboard, 64, 4);
REEF_ASSERT_LAYOUT(reef_mesh_draw, 48, 4);
REEF_ASSERT_LAYOUT(reef_draw_vertex, 20, 4);
REEF_ASSERT_LAYOUT(reef_flow, 128, 8);
REEF_ASSERT_LAYOUT(reef_actor, 104, 8);
REEF_ASSERT_LAYOUT(reef_debug_line, 48, 8);
REEF_ASSERT_LAYOUT(reef_trace, 48, 8);
REEF_ASSERT_LAYOUT(reef_camera, 72, 8);
REEF_ASSERT_LAYOUT(reef_water, 32, 4);
REEF_ASSERT_LAYOUT(reef_wave, 32, 4);
REEF_ASSERT_LAYOUT(reef_heightfield, 40, 8);
REEF_ASSERT_LAYOUT(reef_obstacle, 48, 8);
REEF_ASSERT_LAYOUT(reef_event, 64, 8);
REEF_ASSERT_LAYOUT(reef_step, 128, 8);
REEF_ASSERT_LAYOUT(reef_output, 32, 8);
REEF_ASSERT_LAYOUT(reef_flow_query, 96, 8);
REEF_ASSERT_LAYOUT(reef_mesh_vertex, 40, 4);
REEF_ASSERT_LAYOUT(reef_mesh_level, 32, 4);
REEF_ASSERT_LAYOUT(reef_mesh, 88, 8);
REEF_ASSERT_LAYOUT(reef_texture, 40, 8);
REEF_ASSERT_LAYOUT(reef_host, 128, 8);
REEF_ASSERT_LAYOUT(reef_limits, 40, 8);
REEF_ASSERT_LAYOUT(reef_param, 104, 8);
REEF_ASSERT_LAYOUT(reef_writer, 32, 8);
REEF_ASSERT_LAYOUT(reef_reader, 32, 8);
REEF_ASSERT_LAYOUT(reef_instance, 72, 8);
REEF_ASSERT_LAYOUT(reef_descriptor, 104, 8);
REEF_ASSERT_LAYOUT(reef_entry, 56, 8);
#endif /* REEF_NO_ASSERTS */

#ifdef __cplusplus
}
#endif
#endif /* REEF_SIM_H */
