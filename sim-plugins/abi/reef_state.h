/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * reef_state.h — saved states as tagged fields, for plugins in C and C++. Optional: what a plugin writes is its own. The Rust SDK
 * writes the same, so one may read what the other wrote. Little-endian, without pointers:
 *
 *   "REEFSTAT", uint32_t fields, uint32_t 0; then per field:
 *   uint64_t FNV-1a of its name, uint32_t type, uint32_t 0, uint64_t count; the values, padded with zeros to 8 bytes.
 *
 * A reader skips fields that it does not know: one may be added or dropped without a new state version.
 *
 * save_state:  reef_state_begin(writer, 2), then reef_state_put(writer, "angles", REEF_STATE_F32, angles, count) for each of the two.
 * load_state:  an array of reef_state_field says what is wanted and where it goes; reef_state_read(reader, fields, 2, 0) fills all of
 *              them or returns what is wrong. Read into a copy, and take that over when all is well. */
#ifndef REEF_STATE_H
#define REEF_STATE_H

#include "reef_sim.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

#define REEF_STATE_U8 1u
#define REEF_STATE_U32 2u
#define REEF_STATE_I32 3u
#define REEF_STATE_U64 4u
#define REEF_STATE_I64 5u
#define REEF_STATE_F32 6u
#define REEF_STATE_F64 7u

/* A field that a plugin reads. */
typedef struct reef_state_field {
  const char *name;
  uint32_t type;  /* REEF_STATE_* */
  int32_t found;  /* filled: whether it was there */
  uint64_t count; /* how many values it has, neither more nor less */
  void *values;   /* filled */
} reef_state_field;

/* Bytes of a value; 0: there is no such type. */
static inline uint64_t reef_state_size(uint32_t type) {
  switch (type) {
  case REEF_STATE_U8: return 1;
  case REEF_STATE_U32: case REEF_STATE_I32: case REEF_STATE_F32: return 4;
  case REEF_STATE_U64: case REEF_STATE_I64: case REEF_STATE_F64: return 8;
  default: return 0;
  }
}

/* FNV-1a (64 bits) of a name. */
static inline uint64_t reef_state_tag(const char *name) {
  uint64_t hash = 0xcbf29ce484222325ull;
  while (*name) hash = (hash ^ (uint8_t)*name++) * 0x100000001b3ull;
  return hash;
}

/* The head of a state of so many fields, each of which reef_state_put writes. Returns a status. */
static inline int32_t reef_state_begin(const reef_writer *writer, uint32_t fields) {
  uint8_t head[16] = {'R', 'E', 'E', 'F', 'S', 'T', 'A', 'T', 0, 0, 0, 0, 0, 0, 0, 0};
  memcpy(head + 8, &fields, sizeof fields);
  return writer->write(writer->ctx, head, sizeof head);
}

/* A field. Each name is used once. Returns a status. */
static inline int32_t reef_state_put(const reef_writer *writer, const char *name, uint32_t type, const void *values,
                                     uint64_t count) {
  const uint64_t tag = reef_state_tag(name), length = count * reef_state_size(type), zeros = 0;
  uint8_t head[24];
  int32_t status;
  memset(head, 0, sizeof head);
  memcpy(head, &tag, sizeof tag);
  memcpy(head + 8, &type, sizeof type);
  memcpy(head + 16, &count, sizeof count);
  if ((status = writer->write(writer->ctx, head, sizeof head))) return status;
  if (length && (status = writer->write(writer->ctx, values, length))) return status;
  return length % 8 ? writer->write(writer->ctx, &zeros, 8 - length % 8) : REEF_OK;
}

/* Reads exactly `length` bytes, into nowhere where `into` is NULL; 0: there are fewer. */
static inline int32_t reef_state_take(const reef_reader *reader, void *into, uint64_t length) {
  uint8_t nowhere[256], *at = (uint8_t *)into;
  while (length > 0) {
    const uint64_t most = at || length < sizeof nowhere ? length : sizeof nowhere;
    const int64_t count = reader->read(reader->ctx, at ? at : nowhere, most);
    if (count <= 0 || (uint64_t)count > most) return 0;
    if (at) at += count;
    length -= (uint64_t)count;
  }
  return 1;
}

/* Reads a whole state. NULL: all fields are filled; else what is wrong, for set_error and REEF_BAD_STATE. Where `optional` is not
 * 0, fields that are not there are left as they are, and only `found` tells. */
static inline const char *reef_state_read(const reef_reader *reader, reef_state_field *fields, uint32_t count,
                                          int32_t optional) {
  uint8_t head[24], more;
  uint32_t there, f, i;
  for (i = 0; i < count; i++) fields[i].found = 0;
  if (!reef_state_take(reader, head, 16) || memcmp(head, "REEFSTAT", 8) != 0) return "the state does not begin like one";
  memcpy(&there, head + 8, sizeof there);
  for (f = 0; f < there; f++) {
    uint64_t tag, values, size, length;
    uint32_t type;
    void *into = NULL;
    if (!reef_state_take(reader, head, sizeof head)) return "the state ends too early";
    memcpy(&tag, head, sizeof tag);
    memcpy(&type, head + 8, sizeof type);
    memcpy(&values, head + 16, sizeof values);
    size = reef_state_size(type);
    if (!size || values > 0xffffffffffffffull) return "a field of the state is of an unknown type or length";
    for (i = 0; i < count; i++) {
      if (tag != reef_state_tag(fields[i].name) || fields[i].found) continue;
      if (type != fields[i].type || values != fields[i].count) return "a field of the state has another type or length";
      fields[i].found = 1;
      into = fields[i].values;
    }
    length = values * size;
    if (!reef_state_take(reader, into, length) || !reef_state_take(reader, NULL, (8 - length % 8) % 8))
      return "the state ends too early";
  }
  if (reader->read(reader->ctx, &more, 1) != 0) return "bytes follow the state's end";
  for (i = 0; i < count && !optional; i++)
    if (!fields[i].found) return "the state lacks a field";
  return NULL;
}

#ifdef __cplusplus
}
#endif
#endif /* REEF_STATE_H */
