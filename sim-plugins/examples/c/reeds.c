/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * A minimal plugin in C to copy: a row of reeds that lean with the water.
 *
 *   cc -std=c11 -O2 -fPIC -shared -ffp-contract=off -I ../../abi reeds.c -o libreeds.so
 *
 * Each reed's lean follows the flow at its tip with a time constant, and its nodes stand on a parabola:
 * x(t) = lean t^2, y(t) = height t for t from 0 at the root to 1 at the tip. */
#include "reef_sim.h"

#include <stdlib.h>
#include <string.h>

#define REEDS 16
#define NODES 8
#define HEIGHT 0.3f
#define SPACING 0.05f
#define PARAM_LEAN 1u
#define STATE_VERSION 1u
#define STATE_MAGIC 0x53444552u /* "REDS" */

typedef struct reeds {
  const reef_host *host;
  double lean_per_speed; /* [s] the parameter `lean` */
  float lean[REEDS][2];  /* [m] displacement of the tips along x and z */
} reeds;

static int32_t fail(const reef_host *host, int32_t status, const char *message) {
  host->set_error(host->ctx, message, strlen(message));
  return status;
}

static void start(reeds *self) {
  self->lean_per_speed = 1.0;
  memset(self->lean, 0, sizeof self->lean);
}

/* What the jobs of one step share. */
typedef struct work {
  reeds *self;
  const float *x, *vx, *vz;
  reef_fibre_node *nodes;
  float share;
  uint32_t spare;
} work;

/* Moves one reed and writes its nodes: nothing that belongs to another. */
static void move_reed(void *user, uint32_t reed, uint32_t worker) {
  const work *w = user;
  float *lean = w->self->lean[reed];
  const float per_speed = (float)w->self->lean_per_speed;
  (void)worker;
  lean[0] += w->share * (per_speed * w->vx[reed] - lean[0]);
  lean[1] += w->share * (per_speed * w->vz[reed] - lean[1]);
  for (uint32_t k = 0; k < NODES; k++) {
    const float t = (float)k / (float)(NODES - 1);
    reef_fibre_node *node = &w->nodes[reed * NODES + k];
    node->position[0] = w->x[reed] + lean[0] * t * t;
    node->position[1] = HEIGHT * t;
    node->position[2] = lean[1] * t * t;
    node->radius = 0.004f - 0.003f * t;
  }
}

static int32_t step(void *ctx, const reef_step *input, const reef_output *output) {
  reeds *self = ctx;
  const reef_host *host = self->host;
  float x[REEDS], y[REEDS], z[REEDS], vx[REEDS], vy[REEDS], vz[REEDS];
  void *room;
  int32_t status;

  for (uint32_t i = 0; i < input->event_count; i++) {
    const reef_event *event = &input->events[i];
    if (event->kind == REEF_EVENT_PARAM && event->param == PARAM_LEAN) {
      const double value = event->value;
      self->lean_per_speed = value < 0.0 ? 0.0 : value > 10.0 ? 10.0 : value;
    }
  }
  for (uint32_t reed = 0; reed < REEDS; reed++) {
    x[reed] = (float)reed * SPACING;
    y[reed] = HEIGHT;
    z[reed] = 0.0f;
  }
  const reef_flow_query query = {x, y, z, vx, vy, vz, {0.0, 0.0, 0.0}, 0, REEDS, 0};
  if ((status = host->sample_flow(host->ctx, &query)) != REEF_OK) return status;

  if ((status = output->reserve(output->ctx, REEF_STREAM_FIBRE_NODE, sizeof(reef_fibre_node), REEDS * NODES, &room)))
    return status;
  const float dt = (float)input->dt;
  work w = {self, x, vx, vz, room, dt / (0.3f + dt), 0};
  if ((status = host->parallel_for(host->ctx, REEDS, move_reed, &w)) != REEF_OK) return status;
  if ((status = output->commit(output->ctx, REEF_STREAM_FIBRE_NODE, REEDS * NODES))) return status;

  if ((status = output->reserve(output->ctx, REEF_STREAM_OBJECT, sizeof(reef_object), 1, &room))) return status;
  const reef_object object = {1, 0, {0.0, 0.0, 0.0}, {REEDS * SPACING / 2, HEIGHT / 2, 0.0f}, 1.5f, 0, 0};
  memcpy(room, &object, sizeof object);
  if ((status = output->commit(output->ctx, REEF_STREAM_OBJECT, 1))) return status;

  if ((status = output->reserve(output->ctx, REEF_STREAM_MATERIAL, sizeof(reef_material), 1, &room))) return status;
  reef_material material;
  memset(&material, 0, sizeof material);
  material.base[1] = 0.2f;
  material.base[3] = 1.0f;
  material.tip[1] = 0.5f;
  material.tip[3] = 0.5f;
  material.roughness = 0.8f;
  memcpy(room, &material, sizeof material);
  if ((status = output->commit(output->ctx, REEF_STREAM_MATERIAL, 1))) return status;

  if ((status = output->reserve(output->ctx, REEF_STREAM_FIBRE, sizeof(reef_fibre), REEDS, &room))) return status;
  reef_fibre *fibres = room;
  for (uint32_t reed = 0; reed < REEDS; reed++) {
    const reef_fibre fibre = {0, reed * NODES, NODES, 0, 0, 6, reed, 1.0f, {0.0f, 0.0f, 1.0f}, {0}};
    fibres[reed] = fibre;
  }
  return output->commit(output->ctx, REEF_STREAM_FIBRE, REEDS);
}

static int32_t reset(void *ctx) {
  start(ctx);
  return REEF_OK;
}

/* The bytes of a state: this magic, then the parameter, then the leans (a machine of the other byte order is refused by
 * the magic). */
static int32_t save_state(void *ctx, const reef_writer *writer) {
  const reeds *self = ctx;
  const uint32_t magic = STATE_MAGIC;
  int32_t status;
  if ((status = writer->write(writer->ctx, &magic, sizeof magic))) return status;
  if ((status = writer->write(writer->ctx, &self->lean_per_speed, sizeof self->lean_per_speed))) return status;
  return writer->write(writer->ctx, self->lean, sizeof self->lean);
}

/* Reads exactly `length` bytes; 0: there are fewer. */
static int read_all(const reef_reader *reader, void *into, uint64_t length) {
  char *at = into;
  while (length > 0) {
    const uint64_t count = reader->read(reader->ctx, at, length);
    if (count == 0) return 0;
    at += count;
    length -= count;
  }
  return 1;
}

static int32_t load_state(void *ctx, const reef_reader *reader) {
  reeds *self = ctx;
  reeds loaded = *self;
  uint32_t magic;
  char more;
  if (!read_all(reader, &magic, sizeof magic) || magic != STATE_MAGIC ||
      !read_all(reader, &loaded.lean_per_speed, sizeof loaded.lean_per_speed) ||
      !read_all(reader, loaded.lean, sizeof loaded.lean) || reader->read(reader->ctx, &more, 1) != 0)
    return fail(self->host, REEF_BAD_STATE, "these bytes are no state of these reeds");
  *self = loaded;
  return REEF_OK;
}

static int32_t get_param(void *ctx, uint32_t id, double *out_value) {
  const reeds *self = ctx;
  if (id != PARAM_LEAN) return fail(self->host, REEF_BAD_INPUT, "there is no such parameter");
  *out_value = self->lean_per_speed;
  return REEF_OK;
}

static void destroy(void *ctx) { free(ctx); }

static int32_t create(const reef_host *host, const char *config, uint64_t length, reef_instance *out) {
  (void)config; /* A real plugin reads its JSON and names the path of what is wrong in it. */
  (void)length;
  if (out->size < sizeof(reef_instance)) return fail(host, REEF_UNSUPPORTED, "the host is too old for this plugin");
  reeds *self = malloc(sizeof *self);
  if (!self) return fail(host, REEF_NO_SPACE, "no memory for the reeds");
  self->host = host;
  start(self);
  const reef_instance instance = {sizeof(reef_instance), 0,          self,       destroy,  reset,
                                  step,                  save_state, load_state, get_param};
  *out = instance;
  return REEF_OK;
}

static const reef_param params[] = {
    {PARAM_LEAN, REEF_PARAM_FLOAT, 0, 0, 0.0, 10.0, 1.0, "lean", "Lean", "Reeds", "s",
     "How far a tip is displaced per speed of the water.", NULL, {0, 0}},
};

static const reef_descriptor descriptor = {
    sizeof(reef_descriptor),
    0,
    "example.reeds-c",
    "Reeds in C",
    "1.0.0",
    "Reef",
    "A row of reeds that lean with the water, in C.",
    "{\"type\": \"object\"}",
    params,
    1,
    STATE_VERSION,
    STATE_VERSION,
    0,
    create,
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
