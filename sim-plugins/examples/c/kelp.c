/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * A plugin in C to learn from: a small forest of kelp that bends in the water. Build it with `make`.
 *
 * A stalk is a chain of segments of equal length, lifted by its floats and dragged by the water. At rest, the slope of
 * a segment is the drag of all that is above it over the lift of all that is above it; a stalk follows that slope with a
 * delay. Blades grow from its nodes and stream with it. The stalks calm the water between them.
 *
 * The same plugin stands beside this one in C++ and in Rust, and emits the same bytes. Hence every sum has one order,
 * only + - * / and sqrt are used, which IEEE 754 rounds alike everywhere, and -ffp-contract=off keeps them from being fused. */
#include "reef_sim.h"
#include "reef_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifndef KELP_ID /* A test builds the three kelps under one id: then even the states that the host saves are the same bytes. */
#define KELP_ID "example.kelp-c"
#endif

#define MOST 64u       /* stalks */
#define SEGMENTS 16u   /* of a stalk */
#define NODES 17u      /* of a stalk */
#define FIRST_BLADE 2u /* node that bears the lowest blade */
#define BLADES (NODES - FIRST_BLADE)
#define BLADE_NODES 6u
#define ALL_FIBRES (1u + BLADES) /* of a stalk: itself, then its blades from below */
#define ALL_NODES (NODES + BLADES * BLADE_NODES)

#define SPACING 0.12f          /* [m] between neighbouring stalks, about */
#define LIFT 0.02f             /* [m2/s2] square of the speed whose drag equals the lift: 0.14 m/s */
#define LEAN 0.06f             /* slope of a stalk in still water, away from the middle */
#define CROOK 0.4f             /* most by which a segment differs from that, from side to side */
#define GOLDEN_COS -0.7373689f /* of the golden angle, 137.5 degrees */
#define GOLDEN_SIN 0.6754903f

/* ---------------------------------------------------------------------------------------------------- parameters */
enum { COUNT, HEIGHT, STIFFNESS, DELAY, X, Z, PARAMS };

static const reef_param params[PARAMS] = {
    {1, REEF_PARAM_INT, 0, 0, 1.0, MOST, 12.0, "count", "Stalks", "Kelp", "", "How many stalks grow.", NULL, {0, 0}},
    {2, REEF_PARAM_FLOAT, 0, 0, 0.2, 5.0, 1.4, "height", "Height", "Kelp", "m", "Length of the longest stalk.", NULL,
     {0, 0}},
    {3, REEF_PARAM_FLOAT, REEF_PARAM_LOG, 0, 0.1, 10.0, 1.0, "stiffness", "Stiffness", "Kelp", "",
     "Factor on what holds the stalks upright.", NULL, {0, 0}},
    {4, REEF_PARAM_FLOAT, REEF_PARAM_LOG, 0, 0.02, 10.0, 0.7, "delay", "Delay", "Kelp", "s",
     "How slowly the stalks follow the water.", NULL, {0, 0}},
    {5, REEF_PARAM_FLOAT, 0, 0, -10000.0, 10000.0, 0.0, "x", "x", "Place", "m", "Where the forest stands.", NULL, {0, 0}},
    {6, REEF_PARAM_FLOAT, 0, 0, -10000.0, 10000.0, 0.0, "z", "z", "Place", "m", "Where the forest stands.", NULL, {0, 0}},
};

/* One module of a scene. */
typedef struct kelp {
  const reef_host *host;
  double values[PARAMS];         /* of the parameters */
  float bend[MOST][SEGMENTS][2]; /* slope of each segment along x and z: what a saved state holds */
} kelp;

static void start(kelp *self) {
  for (uint32_t p = 0; p < PARAMS; p++) self->values[p] = params[p].default_value;
  memset(self->bend, 0, sizeof self->bend);
}

/* Takes a value into the parameter's range. An id that is not there, or no number, changes nothing. */
static void set_param(kelp *self, uint32_t id, double value) {
  for (uint32_t p = 0; p < PARAMS; p++) {
    if (params[p].id != id || isnan(value)) continue;
    if (value < params[p].minimum) value = params[p].minimum;
    if (value > params[p].maximum) value = params[p].maximum;
    self->values[p] = params[p].kind == REEF_PARAM_INT ? round(value) : value;
  }
}

static int32_t fail(const reef_host *host, int32_t status, const char *message) {
  host->set_error(host->ctx, message, strlen(message));
  return status;
}

/* ---------------------------------------------------------------------------------------------------------- step */

/* A stalk as it stands in this step. */
typedef struct stalk {
  float root[3]; /* [m] relative to the origin */
  float out[2];  /* unit vector away from the middle */
  float segment; /* [m] length of a segment */
  uint32_t hash;
} stalk;

/* What the jobs of one step share. */
typedef struct work {
  kelp *self;
  const stalk *stalks;
  const float *vx, *vz; /* [m/s] water at the upper end of each segment */
  reef_fibre *fibres;
  reef_fibre_node *nodes;
  reef_debug_line *lines; /* NULL: not wanted */
  double origin[3];
  float dt, stiffness, delay;
} work;

/* A hash of one number (a permutation of all 32-bit numbers). */
static uint32_t mix(uint32_t v) {
  v = (v ^ (v >> 16)) * 0x7feb352du;
  v = (v ^ (v >> 15)) * 0x846ca68bu;
  return v ^ (v >> 16);
}

/* 0 to below 1. */
static float unit(uint32_t hash) { return (float)(hash >> 8) * (1.0f / 16777216.0f); }

/* The two samples around `p` and the way between them, at an edge the edge's. */
static uint32_t place(double p, double origin, float cell, uint32_t count, float *share) {
  double u = (p - origin) / (double)cell;
  if (u < 0.0) u = 0.0;
  if (u > (double)(count - 1)) u = (double)(count - 1);
  uint32_t i = (uint32_t)u;
  if (count >= 2 && i > count - 2) i = count - 2;
  *share = (float)(u - (double)i);
  return i;
}

/* y of the bed: bilinear between the heights; without heights it is level. */
static float bed(const reef_step *input, double x, double z) {
  const reef_heightfield *field = input->heightfield;
  if (!field) return -input->water->depth;
  float u, v;
  const uint32_t i = place(x, field->origin[0], field->cell, field->columns, &u);
  const uint32_t j = place(z, field->origin[1], field->cell, field->rows, &v);
  const uint32_t right = i + 1 < field->columns ? i + 1 : i, far = j + 1 < field->rows ? j + 1 : j;
  const float *a = field->heights + (size_t)j * field->columns, *b = field->heights + (size_t)far * field->columns;
  const float low = a[i] + (a[right] - a[i]) * u, high = b[i] + (b[right] - b[i]) * u;
  return low + (high - low) * v;
}

/* Puts the stalks on the bed, the next one always turned by the golden angle and a little farther out. */
static void stand(const kelp *self, const reef_step *input, uint32_t count, double origin[3], stalk *stalks) {
  const double x = self->values[X], z = self->values[Z];
  const float ground = bed(input, x, z), height = (float)self->values[HEIGHT];
  float c = 1.0f, s = 0.0f;
  origin[0] = x;
  origin[1] = ground;
  origin[2] = z;
  for (uint32_t n = 0; n < count; n++) {
    stalk *st = &stalks[n];
    const float radius = SPACING * sqrtf((float)n + 0.5f);
    st->hash = mix((uint32_t)input->seed ^ mix(n));
    st->out[0] = c;
    st->out[1] = s;
    st->root[0] = radius * c;
    st->root[2] = radius * s;
    st->root[1] = bed(input, x + (double)st->root[0], z + (double)st->root[2]) - ground;
    st->segment = height * (0.6f + 0.4f * unit(st->hash)) / (float)SEGMENTS;
    const float turned = c * GOLDEN_COS - s * GOLDEN_SIN;
    s = c * GOLDEN_SIN + s * GOLDEN_COS;
    c = turned;
  }
}

/* A stalk's nodes from its bend. */
static void grow(const stalk *st, float bend[SEGMENTS][2], float nodes[NODES][3]) {
  memcpy(nodes[0], st->root, sizeof nodes[0]);
  for (uint32_t k = 0; k < SEGMENTS; k++) {
    const float bx = bend[k][0], bz = bend[k][1];
    const float rise = st->segment / sqrtf(1.0f + bx * bx + bz * bz);
    nodes[k + 1][0] = nodes[k][0] + bx * rise;
    nodes[k + 1][1] = nodes[k][1] + rise;
    nodes[k + 1][2] = nodes[k][2] + bz * rise;
  }
}

/* Lets a stalk follow the water, from the tip down, as the drag adds up. */
static void bend_stalk(const work *w, uint32_t n) {
  const stalk *st = &w->stalks[n];
  float drag[2] = {0.0f, 0.0f};
  for (uint32_t k = SEGMENTS; k-- > 0;) {
    const float vx = w->vx[n * SEGMENTS + k], vz = w->vz[n * SEGMENTS + k];
    const float speed = sqrtf(vx * vx + vz * vz);
    const float lift = LIFT * w->stiffness * (float)(SEGMENTS - k);
    const float delay = w->delay * (0.5f + (float)(k + 1) / (float)SEGMENTS); /* The tip is the last to follow. */
    const float share = w->dt / (delay + w->dt); /* An implicit step: stable at any length, exactly still for dt = 0. */
    float *bend = w->self->bend[n][k];
    const float crook_x = CROOK * (unit(mix(st->hash + 2 * k)) - 0.5f);
    const float crook_z = CROOK * (unit(mix(st->hash + 2 * k + 1)) - 0.5f);
    drag[0] += speed * vx;
    drag[1] += speed * vz;
    bend[0] += share * (LEAN * st->out[0] + crook_x + drag[0] / lift - bend[0]);
    bend[1] += share * (LEAN * st->out[1] + crook_z + drag[1] / lift - bend[1]);
  }
}

/* A blade: out from its node and up, then over, and all of it along with the bend of the stalk. */
static void grow_blade(const float root[3], const float out[2], const float bend[2], float length, float width,
                       reef_fibre_node *nodes, float normal[3]) {
  float p[3] = {root[0], root[1], root[2]};
  for (uint32_t i = 0; i < BLADE_NODES; i++) {
    const float q = (float)i / (float)(BLADE_NODES - 1);
    memcpy(nodes[i].position, p, sizeof p);
    nodes[i].radius = width * (0.1f + 3.6f * q * (1.0f - q));
    const float d[3] = {out[0] * (1.0f - 0.4f * q) + 2.5f * bend[0] * (0.3f + q), 0.5f - 0.9f * q,
                        out[1] * (1.0f - 0.4f * q) + 2.5f * bend[1] * (0.3f + q)};
    const float scale = length / (float)(BLADE_NODES - 1) / sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (i == 0) { /* The blade is wide across its first segment, and level. */
      const float across = sqrtf(d[0] * d[0] + d[2] * d[2]);
      const int upright = across < 1e-6f;
      normal[0] = upright ? 1.0f : -d[2] / across;
      normal[1] = 0.0f;
      normal[2] = upright ? 0.0f : d[0] / across;
    }
    for (uint32_t axis = 0; axis < 3; axis++) p[axis] += d[axis] * scale;
  }
}

/* Moves one stalk and writes its fibres and nodes: nothing that belongs to another. */
static void move_stalk(void *user, uint32_t n, uint32_t worker) {
  const work *w = (const work *)user;
  const stalk *st = &w->stalks[n];
  float(*bend)[2] = w->self->bend[n];
  reef_fibre_node *nodes = w->nodes + (size_t)n * ALL_NODES;
  reef_fibre *fibres = w->fibres + (size_t)n * ALL_FIBRES;
  float chain[NODES][3], c = st->out[0], s = st->out[1];
  (void)worker;

  bend_stalk(w, n);
  grow(st, bend, chain);
  for (uint32_t k = 0; k < NODES; k++) {
    memcpy(nodes[k].position, chain[k], sizeof chain[k]);
    nodes[k].radius = st->segment * (0.07f - 0.04f * ((float)k / (float)SEGMENTS));
  }
  const reef_fibre stem = {0, n * ALL_NODES, NODES, 0, 0, 8, st->hash, 1.0f, {-s, 0.0f, c}, {0}};
  fibres[0] = stem;

  for (uint32_t b = 0; b < BLADES; b++) {
    const uint32_t node = FIRST_BLADE + b, first = NODES + b * BLADE_NODES, hash = mix(st->hash - b - 1);
    reef_fibre blade = {0, n * ALL_NODES + first, BLADE_NODES, 1, REEF_FIBRE_BLADE, 6, hash, 0.08f, {0}, {0}};
    const float turned = c * GOLDEN_COS - s * GOLDEN_SIN;
    s = c * GOLDEN_SIN + s * GOLDEN_COS;
    c = turned;
    const float out[2] = {c, s}, length = st->segment * (3.5f + 1.5f * unit(hash));
    grow_blade(chain[node], out, bend[node - 1], length, 0.1f * length, nodes + first, blade.normal);
    fibres[1 + b] = blade;
  }

  for (uint32_t k = 0; w->lines && k < SEGMENTS; k++) { /* The water that each segment feels. */
    reef_debug_line line = {{0}, {w->vx[n * SEGMENTS + k], 0.0f, w->vz[n * SEGMENTS + k]}, 0xff30c0ffu, 0, 0};
    for (uint32_t axis = 0; axis < 3; axis++) line.from[axis] = w->origin[axis] + (double)chain[k + 1][axis];
    w->lines[n * SEGMENTS + k] = line;
  }
}

/* Reserves, copies and commits what is known at once. */
static int32_t emit(const reef_output *output, uint32_t stream, const void *elements, uint32_t size, uint64_t count) {
  void *room;
  const int32_t status = output->reserve(output->ctx, stream, size, count, &room);
  if (status != REEF_OK) return status;
  memcpy(room, elements, size * count);
  return output->commit(output->ctx, stream, count);
}

/* What recordings see: each stalk and each blade an object of its own, its nodes from the root to the tip. */
static int32_t trace(const work *w, const reef_output *output, uint32_t fibres) {
  void *room;
  const uint64_t count = (uint64_t)fibres / ALL_FIBRES * ALL_NODES;
  const int32_t status = output->reserve(output->ctx, REEF_STREAM_TRACE, sizeof(reef_trace), count, &room);
  if (status != REEF_OK) return status;
  reef_trace *next = (reef_trace *)room;
  for (uint32_t f = 0; f < fibres; f++) {
    for (uint32_t k = 0; k < w->fibres[f].node_count; k++) {
      const reef_fibre_node *node = &w->nodes[w->fibres[f].first_node + k];
      reef_trace point = {f, {0}, node->radius, k, 0, 0};
      for (uint32_t axis = 0; axis < 3; axis++) point.position[axis] = w->origin[axis] + (double)node->position[axis];
      *next++ = point;
    }
  }
  return output->commit(output->ctx, REEF_STREAM_TRACE, count);
}

static int32_t advance(kelp *self, const reef_step *input, const reef_output *output) {
  const reef_host *host = self->host;
  void *room, *fibres, *nodes, *lines = NULL;
  int32_t status;

  for (uint32_t i = 0; i < input->event_count; i++) {
    const reef_event *event = &input->events[i];
    if (event->kind == REEF_EVENT_PARAM) set_param(self, event->param, event->value);
  }
  const uint32_t count = (uint32_t)self->values[COUNT], points = count * SEGMENTS;
  const float height = (float)self->values[HEIGHT];
  work w = {self, NULL, NULL, NULL, NULL, NULL, NULL, {0}, (float)input->dt, (float)self->values[STIFFNESS],
            (float)self->values[DELAY]};

  if ((status = host->scratch(host->ctx, count * sizeof(stalk), sizeof(float), &room))) return status;
  stalk *stalks = (stalk *)room;
  stand(self, input, count, w.origin, stalks);
  if ((status = host->scratch(host->ctx, 6 * points * sizeof(float), sizeof(float), &room))) return status;
  float *x = (float *)room, *y = x + points, *z = y + points, *vx = z + points, *vy = vx + points, *vz = vy + points;
  for (uint32_t n = 0; n < count; n++) {
    float chain[NODES][3];
    grow(&stalks[n], self->bend[n], chain);
    for (uint32_t k = 0; k < SEGMENTS; k++) {
      x[n * SEGMENTS + k] = chain[k + 1][0];
      y[n * SEGMENTS + k] = chain[k + 1][1];
      z[n * SEGMENTS + k] = chain[k + 1][2];
    }
  }
  /* All points at once, without the shelter that object 1, the forest, gives itself. */
  const reef_flow_query query = {x, y, z, vx, vy, vz, {w.origin[0], w.origin[1], w.origin[2]}, 1, NULL, points, 0};
  if ((status = host->sample_flow(host->ctx, &query))) return status;

  /* Room first: after this nothing can fail that leaves half a step behind. */
  const uint32_t all_fibres = count * ALL_FIBRES, all_nodes = count * ALL_NODES;
  if ((status = output->reserve(output->ctx, REEF_STREAM_FIBRE, sizeof(reef_fibre), all_fibres, &fibres))) return status;
  if ((status = output->reserve(output->ctx, REEF_STREAM_FIBRE_NODE, sizeof(reef_fibre_node), all_nodes, &nodes)))
    return status;
  const int wants_lines = (input->flags & REEF_STEP_DEBUG) != 0;
  if (wants_lines) {
    status = output->reserve(output->ctx, REEF_STREAM_DEBUG_LINE, sizeof(reef_debug_line), points, &lines);
    if (status == REEF_UNSUPPORTED) lines = NULL; /* A host without debug lines: the step goes on. */
    else if (status) return status;
  }
  const float reach = height + SPACING * sqrtf((float)count);
  const reef_object object = {1, 0, {w.origin[0], w.origin[1], w.origin[2]}, {0.0f, height / 2.0f, 0.0f}, reach, 0, 0};
  if ((status = emit(output, REEF_STREAM_OBJECT, &object, sizeof object, 1))) return status;
  reef_material materials[2] = {
      {{0.30f, 0.20f, 0.05f, 1.0f}, {0.45f, 0.34f, 0.08f, 0.3f}, {0}, 0, 0, 0, 0, 0.2f, 0.3f, 0.2f, 0, 0.7f, 0.0003f, {0}},
      {{0.48f, 0.36f, 0.07f, 1.0f}, {0.66f, 0.52f, 0.12f, 0.2f}, {0.26f, 0.18f, 0.03f, 0.35f}, REEF_PATTERN_BLOTCHES, 0,
       90.0f, 0.8f, 0.85f, 0.5f, 0.3f, 0, 0.6f, 0.0003f, {0}},
  };
  if ((status = emit(output, REEF_STREAM_MATERIAL, materials, sizeof materials[0], 2))) return status;
  reef_flow shelter;
  memset(&shelter, 0, sizeof shelter);
  shelter.owner = 1;
  shelter.kind = REEF_FLOW_SHELTER;
  shelter.position[0] = w.origin[0];
  shelter.position[1] = w.origin[1] + (double)height / 2.0;
  shelter.position[2] = w.origin[2];
  shelter.strength = 0.3f;
  shelter.reach = reach;
  shelter.fade = 0.5f;
  if ((status = emit(output, REEF_STREAM_FLOW, &shelter, sizeof shelter, 1))) return status;

  w.stalks = stalks;
  w.vx = vx;
  w.vz = vz;
  w.fibres = (reef_fibre *)fibres;
  w.nodes = (reef_fibre_node *)nodes;
  w.lines = (reef_debug_line *)lines;
  /* Hosts learned this later than the rest: an older table ends before it. */
  if (REEF_HAS(host, figure) && host->figure) host->figure(host->ctx, "stalks", sizeof "stalks" - 1, count);
  if ((status = host->parallel_for(host->ctx, count, move_stalk, &w))) return status;
  if ((status = output->commit(output->ctx, REEF_STREAM_FIBRE, all_fibres))) return status;
  if ((status = output->commit(output->ctx, REEF_STREAM_FIBRE_NODE, all_nodes))) return status;
  if (lines && (status = output->commit(output->ctx, REEF_STREAM_DEBUG_LINE, points))) return status;
  return input->flags & REEF_STEP_TRACE ? trace(&w, output, all_fibres) : REEF_OK;
}

/* A step that fails leaves the parameters as they were. */
static int32_t step(void *ctx, const reef_step *input, const reef_output *output) {
  kelp *self = (kelp *)ctx;
  double before[PARAMS];
  memcpy(before, self->values, sizeof before);
  const int32_t status = advance(self, input, output);
  if (status != REEF_OK) memcpy(self->values, before, sizeof before);
  return status;
}

/* --------------------------------------------------------------------------------------------------------- state
 * Tagged fields, as the Rust SDK writes them, so that all three kelps read each other's payload. */
#define STATE_VERSION 1u

static int32_t save_state(void *ctx, const reef_writer *writer) {
  const kelp *self = (const kelp *)ctx;
  uint32_t ids[PARAMS];
  int32_t status;
  for (uint32_t p = 0; p < PARAMS; p++) ids[p] = params[p].id;
  if ((status = reef_state_begin(writer, 3))) return status;
  if ((status = reef_state_put(writer, "reef.params.ids", REEF_STATE_U32, ids, PARAMS))) return status;
  if ((status = reef_state_put(writer, "reef.params.values", REEF_STATE_F64, self->values, PARAMS))) return status;
  return reef_state_put(writer, "bend", REEF_STATE_F32, self->bend, MOST * SEGMENTS * 2);
}

static int32_t load_state(void *ctx, const reef_reader *reader) {
  kelp *self = (kelp *)ctx;
  kelp loaded = *self; /* All or nothing. */
  uint32_t ids[PARAMS];
  double values[PARAMS];
  reef_state_field wanted[3] = {
      {"reef.params.ids", REEF_STATE_U32, 0, PARAMS, ids},
      {"reef.params.values", REEF_STATE_F64, 0, PARAMS, values},
      {"bend", REEF_STATE_F32, 0, MOST * SEGMENTS * 2, loaded.bend},
  };
  if (reader->state_version != STATE_VERSION)
    return fail(self->host, REEF_BAD_STATE, "the state is of another version than this kelp reads");
  const char *problem = reef_state_read(reader, wanted, 3, 0);
  if (problem) return fail(self->host, REEF_BAD_STATE, problem);
  for (uint32_t p = 0; p < PARAMS; p++) set_param(&loaded, ids[p], values[p]);
  *self = loaded;
  return REEF_OK;
}

/* ------------------------------------------------------------------------------------------ instance, descriptor */
static int32_t reset(void *ctx) {
  start((kelp *)ctx);
  return REEF_OK;
}

static int32_t get_param(void *ctx, uint32_t id, double *out_value) {
  const kelp *self = (const kelp *)ctx;
  for (uint32_t p = 0; p < PARAMS; p++) {
    if (params[p].id == id) {
      *out_value = self->values[p];
      return REEF_OK;
    }
  }
  return fail(self->host, REEF_BAD_INPUT, "there is no such parameter");
}

static void destroy(void *ctx) { free(ctx); }

static int32_t create(const reef_host *host, const char *config, uint64_t length, reef_instance *out) {
  (void)config; /* The schema allows no keys, and the host has held the scene against it. */
  (void)length;
  if (!REEF_HAS(out, get_param)) return fail(host, REEF_UNSUPPORTED, "the host is too old for this plugin");
  kelp *self = (kelp *)malloc(sizeof *self);
  if (!self) return fail(host, REEF_NO_SPACE, "there is no memory for the kelp");
  self->host = host;
  start(self);
  const reef_instance instance = {sizeof(reef_instance), 0,          self,       destroy,  reset,
                                  step,                  save_state, load_state, get_param, NULL};
  *out = instance;
  return REEF_OK;
}

/* What the traces are of: their kind is an index. */
static const char *const traces[] = {"fibre"};

static const reef_descriptor descriptor = {
    sizeof(reef_descriptor),
    0,
    KELP_ID,
    "Kelp in C",
    "1.0.0",
    "Reef",
    "A small forest of kelp that bends in the water, in C.",
    "{\"type\": \"object\", \"additionalProperties\": false}",
    params,
    PARAMS,
    STATE_VERSION,
    STATE_VERSION, /* the oldest that load_state reads */
    0,
    create,
    traces,
    1,
    0,
};

static const reef_descriptor *const descriptors[] = {&descriptor};

static int32_t open_library(const reef_host *host) {
  (void)host;
  return REEF_OK;
}

static void close_library(void) {}

const reef_entry reef_sim_entry = {
    REEF_MAGIC, sizeof(reef_entry), REEF_VERSION, REEF_HEADER_HASH, 1, 0, descriptors, open_library, close_library,
};
