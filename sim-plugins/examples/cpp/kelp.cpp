// SPDX-License-Identifier: MIT OR Apache-2.0
//
// A plugin in C++17 to learn from: a small forest of kelp that bends in the water. Build it with `make`.
//
// A stalk is a chain of segments of equal length, lifted by its floats and dragged by the water. At rest, the slope of a
// segment is the drag of all that is above it over the lift of all that is above it; a stalk follows that slope with a
// delay. Blades grow from its nodes and stream with it. The stalks calm the water between them.
//
// The same plugin stands beside this one in C and in Rust, and emits the same bytes. Hence every sum has one order, only
// + - * / and sqrt are used, which IEEE 754 rounds alike everywhere, and -ffp-contract=off keeps them from being fused.
// -fno-gnu-unique lets the library be unloaded: g++ would pin it in memory for a static in an inline function or template.
// No exception leaves this file: `guarded` turns each into a status and a message.
#include "reef_sim.h"
#include "reef_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#ifndef KELP_ID // A test builds the three kelps under one id: then even the states that the host saves are the same bytes.
#define KELP_ID "example.kelp-cpp"
#endif

namespace {

constexpr std::uint32_t most = 64;       // stalks
constexpr std::uint32_t segments = 16;   // of a stalk
constexpr std::uint32_t node_count = 17; // of a stalk
constexpr std::uint32_t first_blade = 2; // node that bears the lowest blade
constexpr std::uint32_t blades = node_count - first_blade;
constexpr std::uint32_t blade_nodes = 6;
constexpr std::uint32_t all_fibres = 1 + blades; // of a stalk: itself, then its blades from below
constexpr std::uint32_t all_nodes = node_count + blades * blade_nodes;

constexpr float spacing = 0.12f; // [m] between neighbouring stalks, about
constexpr float lift = 0.02f;    // [m2/s2] square of the speed whose drag equals the lift: 0.14 m/s
constexpr float lean = 0.06f;    // slope of a stalk in still water, away from the middle
constexpr float crook = 0.4f;    // most by which a segment differs from that, from side to side

using Vec2 = std::array<float, 2>;
using Vec3 = std::array<float, 3>;
using Bend = std::array<Vec2, segments>;     // slope of each segment along x and z
using Chain = std::array<Vec3, node_count>;

// ------------------------------------------------------------------------------------------------------- parameters
enum : std::size_t { Count, Height, Stiffness, Delay, X, Z };

constexpr std::array<reef_param, 6> params{{
    {1, REEF_PARAM_INT, 0, 0, 1.0, most, 12.0, "count", "Stalks", "Kelp", "", "How many stalks grow.", nullptr, {}},
    {2, REEF_PARAM_FLOAT, 0, 0, 0.2, 5.0, 1.4, "height", "Height", "Kelp", "m", "Length of the longest stalk.", nullptr, {}},
    {3, REEF_PARAM_FLOAT, REEF_PARAM_LOG, 0, 0.1, 10.0, 1.0, "stiffness", "Stiffness", "Kelp", "",
     "Factor on what holds the stalks upright.", nullptr, {}},
    {4, REEF_PARAM_FLOAT, REEF_PARAM_LOG, 0, 0.02, 10.0, 0.7, "delay", "Delay", "Kelp", "s",
     "How slowly the stalks follow the water.", nullptr, {}},
    {5, REEF_PARAM_FLOAT, 0, 0, -10000.0, 10000.0, 0.0, "x", "x", "Place", "m", "Where the forest stands.", nullptr, {}},
    {6, REEF_PARAM_FLOAT, 0, 0, -10000.0, 10000.0, 0.0, "z", "z", "Place", "m", "Where the forest stands.", nullptr, {}},
}};
using Values = std::array<double, params.size()>;

Values defaults() {
  Values values;
  std::transform(params.begin(), params.end(), values.begin(), [](const reef_param &p) { return p.default_value; });
  return values;
}

// Takes a value into the parameter's range. An id that is not there, or no number, changes nothing.
void set_param(Values &values, std::uint32_t id, double value) {
  for (std::size_t p = 0; p < params.size(); ++p) {
    if (params[p].id != id || std::isnan(value)) continue;
    value = std::clamp(value, params[p].minimum, params[p].maximum);
    values[p] = params[p].kind == REEF_PARAM_INT ? std::round(value) : value;
  }
}

// --------------------------------------------------------------------------------------------------------- failures

// A failure with the status that the contract gives it. Without a message the host has a better one already.
struct Failed : std::runtime_error {
  std::int32_t status;
  Failed(std::int32_t code, const std::string &message) : std::runtime_error(message), status(code) {}
};

void check(std::int32_t status) {
  if (status != REEF_OK) throw Failed(status, "");
}

// Runs a call of the host; what it throws becomes a status, and its message is left at the host.
template <class Call> std::int32_t guarded(const reef_host *host, Call call) noexcept {
  const auto fail = [host](std::int32_t status, const char *message) {
    if (*message) host->set_error(host->ctx, message, std::strlen(message));
    return status;
  };
  try {
    call();
    return REEF_OK;
  } catch (const Failed &failed) {
    return fail(failed.status, failed.what());
  } catch (const std::bad_alloc &) {
    return fail(REEF_NO_SPACE, "there is no memory for the kelp");
  } catch (const std::exception &error) {
    return fail(REEF_FATAL, error.what());
  } catch (...) {
    return fail(REEF_FATAL, "an exception of an unknown type");
  }
}

// ------------------------------------------------------------------------------------------------------- host memory

template <class T> T *scratch(const reef_host *host, std::size_t count) {
  void *room = nullptr;
  check(host->scratch(host->ctx, count * sizeof(T), alignof(T), &room));
  return static_cast<T *>(room);
}

template <class T> T *reserve(const reef_output *output, std::uint32_t stream, std::size_t count) {
  void *room = nullptr;
  check(output->reserve(output->ctx, stream, sizeof(T), count, &room));
  return static_cast<T *>(room);
}

// The same, or nothing where the host does not take the stream: the step goes on without.
template <class T> T *offer(const reef_output *output, std::uint32_t stream, std::size_t count) {
  void *room = nullptr;
  const std::int32_t status = output->reserve(output->ctx, stream, sizeof(T), count, &room);
  if (status == REEF_UNSUPPORTED) return nullptr;
  check(status);
  return static_cast<T *>(room);
}

// Reserves, copies and commits what is known at once.
template <class T, std::size_t N> void emit(const reef_output *output, std::uint32_t stream, const T (&elements)[N]) {
  std::copy(std::begin(elements), std::end(elements), reserve<T>(output, stream, N));
  check(output->commit(output->ctx, stream, N));
}

// ------------------------------------------------------------------------------------------------------------- shape

// A stalk as it stands in this step.
struct Stalk {
  Vec3 root;     // [m] relative to the origin
  Vec2 out;      // unit vector away from the middle
  float segment; // [m] length of a segment
  std::uint32_t hash;
};

// A hash of one number (a permutation of all 32-bit numbers).
constexpr std::uint32_t mix(std::uint32_t v) {
  v = (v ^ (v >> 16)) * 0x7feb352du;
  v = (v ^ (v >> 15)) * 0x846ca68bu;
  return v ^ (v >> 16);
}

// 0 to below 1.
constexpr float unit(std::uint32_t hash) { return static_cast<float>(hash >> 8) * (1.0f / 16777216.0f); }

// Turned by the golden angle, 137.5 degrees.
constexpr Vec2 turned(Vec2 v) {
  constexpr float c = -0.7373689f, s = 0.6754903f;
  return {v[0] * c - v[1] * s, v[0] * s + v[1] * c};
}

// The sample before `p`, and the way to the next one; at an edge the edge's.
struct Place {
  std::uint32_t before, after;
  float share;
  Place(double p, double origin, float cell, std::uint32_t count) {
    const double u = std::clamp((p - origin) / double(cell), 0.0, double(count - 1));
    before = std::min(static_cast<std::uint32_t>(u), count < 2 ? 0 : count - 2);
    after = std::min(before + 1, count - 1);
    share = static_cast<float>(u - double(before));
  }
};

// y of the bed: bilinear between the heights; without heights it is level.
float bed(const reef_step &input, double x, double z) {
  const reef_heightfield *field = input.heightfield;
  if (!field) return -input.water->depth;
  const Place i(x, field->origin[0], field->cell, field->columns);
  const Place j(z, field->origin[1], field->cell, field->rows);
  const auto row = [&](std::uint32_t number) {
    const float *heights = field->heights + std::size_t(number) * field->columns;
    return heights[i.before] + (heights[i.after] - heights[i.before]) * i.share;
  };
  const float low = row(j.before), high = row(j.after);
  return low + (high - low) * j.share;
}

// A stalk's nodes from its bend.
Chain grow(const Stalk &stalk, const Bend &bend) {
  Chain nodes;
  nodes[0] = stalk.root;
  for (std::size_t k = 0; k < segments; ++k) {
    const auto [bx, bz] = bend[k];
    const auto [x, y, z] = nodes[k];
    const float rise = stalk.segment / std::sqrt(1.0f + bx * bx + bz * bz);
    nodes[k + 1] = {x + bx * rise, y + rise, z + bz * rise};
  }
  return nodes;
}

// A blade: out from its node and up, then over, and all of it along with the bend of the stalk. The normal is what it is
// wide along: across its first segment, and level.
void grow_blade(const Vec3 &root, Vec2 out, Vec2 bend, float length, float width, reef_fibre_node *nodes, float (&normal)[3]) {
  Vec3 p = root;
  for (std::uint32_t i = 0; i < blade_nodes; ++i) {
    const float q = float(i) / float(blade_nodes - 1);
    nodes[i] = {{p[0], p[1], p[2]}, width * (0.1f + 3.6f * q * (1.0f - q))};
    const Vec3 d{out[0] * (1.0f - 0.4f * q) + 2.5f * bend[0] * (0.3f + q), 0.5f - 0.9f * q,
                 out[1] * (1.0f - 0.4f * q) + 2.5f * bend[1] * (0.3f + q)};
    const float scale = length / float(blade_nodes - 1) / std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (i == 0) {
      const float across = std::sqrt(d[0] * d[0] + d[2] * d[2]);
      const bool upright = across < 1e-6f;
      normal[0] = upright ? 1.0f : -d[2] / across;
      normal[1] = 0.0f;
      normal[2] = upright ? 0.0f : d[0] / across;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += d[axis] * scale;
  }
}

// -------------------------------------------------------------------------------------------------------------- kelp

constexpr std::uint32_t state_version = 1; // of the tagged fields that the Rust SDK writes, too

// One module of a scene.
class Kelp {
public:
  explicit Kelp(const reef_host *table) : host(table) {}

  const reef_host *const host;

  void reset() {
    values = defaults();
    bends = {};
  }

  // A step that fails leaves the parameters as they were.
  void step(const reef_step &input, const reef_output *output) {
    const Values before = values;
    try {
      advance(input, output);
    } catch (...) {
      values = before;
      throw;
    }
  }

  void save(const reef_writer *writer) const {
    std::array<std::uint32_t, params.size()> ids;
    std::transform(params.begin(), params.end(), ids.begin(), [](const reef_param &p) { return p.id; });
    check(reef_state_begin(writer, 3));
    check(reef_state_put(writer, "reef.params.ids", REEF_STATE_U32, ids.data(), ids.size()));
    check(reef_state_put(writer, "reef.params.values", REEF_STATE_F64, values.data(), values.size()));
    check(reef_state_put(writer, "bend", REEF_STATE_F32, bends[0][0].data(), most * segments * 2));
  }

  // All or nothing.
  void load(const reef_reader *reader) {
    std::array<std::uint32_t, params.size()> ids;
    Values read, loaded = values;
    auto bent = std::make_unique<decltype(bends)>();
    reef_state_field wanted[] = {
        {"reef.params.ids", REEF_STATE_U32, 0, ids.size(), ids.data()},
        {"reef.params.values", REEF_STATE_F64, 0, read.size(), read.data()},
        {"bend", REEF_STATE_F32, 0, most * segments * 2, (*bent)[0][0].data()},
    };
    if (reader->state_version != state_version)
      throw Failed(REEF_BAD_STATE, "the state is of another version than this kelp reads");
    if (const char *problem = reef_state_read(reader, wanted, std::size(wanted), 0)) throw Failed(REEF_BAD_STATE, problem);
    for (std::size_t p = 0; p < ids.size(); ++p) set_param(loaded, ids[p], read[p]);
    values = loaded;
    bends = *bent;
  }

  double param(std::uint32_t id) const {
    for (std::size_t p = 0; p < params.size(); ++p)
      if (params[p].id == id) return values[p];
    throw Failed(REEF_BAD_INPUT, "there is no such parameter");
  }

private:
  Values values = defaults();
  std::array<Bend, most> bends{}; // what a saved state holds

  // What the jobs of one step share.
  struct Work {
    Kelp &self;
    const Stalk *stalks;
    const float *vx, *vz; // [m/s] water at the upper end of each segment
    reef_fibre *fibres;
    reef_fibre_node *nodes;
    reef_debug_line *lines; // null: not wanted
    std::array<double, 3> origin;
    float dt;

    std::array<double, 3> world(const float *local) const {
      return {origin[0] + double(local[0]), origin[1] + double(local[1]), origin[2] + double(local[2])};
    }
  };

  // Puts the stalks on the bed, the next one always turned by the golden angle and a little farther out.
  void stand(const reef_step &input, std::uint32_t count, Stalk *stalks) const {
    const double x = values[X], z = values[Z];
    const float ground = bed(input, x, z), height = float(values[Height]);
    Vec2 out{1.0f, 0.0f};
    for (std::uint32_t n = 0; n < count; ++n) {
      const float radius = spacing * std::sqrt(float(n) + 0.5f);
      const float rx = radius * out[0], rz = radius * out[1];
      const std::uint32_t hash = mix(static_cast<std::uint32_t>(input.seed) ^ mix(n));
      stalks[n] = {{rx, bed(input, x + double(rx), z + double(rz)) - ground, rz},
                   out,
                   height * (0.6f + 0.4f * unit(hash)) / float(segments),
                   hash};
      out = turned(out);
    }
  }

  // Lets a stalk follow the water, from the tip down, as the drag adds up.
  void follow(const Work &work, std::uint32_t n) {
    const Stalk &stalk = work.stalks[n];
    Vec2 drag{};
    for (std::uint32_t k = segments; k-- > 0;) {
      const float vx = work.vx[n * segments + k], vz = work.vz[n * segments + k];
      const float speed = std::sqrt(vx * vx + vz * vz);
      const float held = lift * float(values[Stiffness]) * float(segments - k);
      const float delay = float(values[Delay]) * (0.5f + float(k + 1) / float(segments)); // The tip is the last to follow.
      const float share = work.dt / (delay + work.dt); // An implicit step: stable at any length, exactly still for dt = 0.
      Vec2 &bend = bends[n][k];
      const float crook_x = crook * (unit(mix(stalk.hash + 2 * k)) - 0.5f);
      const float crook_z = crook * (unit(mix(stalk.hash + 2 * k + 1)) - 0.5f);
      drag[0] += speed * vx;
      drag[1] += speed * vz;
      bend[0] += share * (lean * stalk.out[0] + crook_x + drag[0] / held - bend[0]);
      bend[1] += share * (lean * stalk.out[1] + crook_z + drag[1] / held - bend[1]);
    }
  }

  // Moves one stalk and writes its fibres and nodes: nothing that belongs to another.
  static void move_stalk(void *user, std::uint32_t n, std::uint32_t) noexcept {
    const Work &work = *static_cast<const Work *>(user);
    const Stalk &stalk = work.stalks[n];
    reef_fibre_node *nodes = work.nodes + std::size_t(n) * all_nodes;
    reef_fibre *fibres = work.fibres + std::size_t(n) * all_fibres;
    work.self.follow(work, n);
    const Bend &bend = work.self.bends[n];
    const Chain chain = grow(stalk, bend);

    for (std::uint32_t k = 0; k < node_count; ++k) {
      const auto [x, y, z] = chain[k];
      nodes[k] = {{x, y, z}, stalk.segment * (0.07f - 0.04f * (float(k) / float(segments)))};
    }
    Vec2 out = stalk.out;
    fibres[0] = {0, n * all_nodes, node_count, 0, 0, 8, stalk.hash, 1.0f, {-out[1], 0.0f, out[0]}, {}};
    for (std::uint32_t b = 0; b < blades; ++b) {
      const std::uint32_t node = first_blade + b, first = node_count + b * blade_nodes, hash = mix(stalk.hash - b - 1);
      const float length = stalk.segment * (3.5f + 1.5f * unit(hash));
      reef_fibre &blade = fibres[1 + b];
      blade = {0, n * all_nodes + first, blade_nodes, 1, REEF_FIBRE_BLADE, 6, hash, 0.08f, {}, {}};
      out = turned(out);
      grow_blade(chain[node], out, bend[node - 1], length, 0.1f * length, nodes + first, blade.normal);
    }
    for (std::uint32_t k = 0; work.lines && k < segments; ++k) { // The water that each segment feels.
      const auto [x, y, z] = work.world(chain[k + 1].data());
      const std::uint32_t at = n * segments + k;
      work.lines[at] = {{x, y, z}, {work.vx[at], 0.0f, work.vz[at]}, 0xff30c0ff, 0, 0};
    }
  }

  // What recordings see: each stalk and each blade an object of its own, its nodes from the root to the tip.
  static void trace(const Work &work, const reef_output *output, std::uint32_t stalks) {
    const std::size_t count = std::size_t(stalks) * all_nodes;
    reef_trace *next = reserve<reef_trace>(output, REEF_STREAM_TRACE, count);
    for (std::uint32_t f = 0; f < stalks * all_fibres; ++f) {
      for (std::uint32_t k = 0; k < work.fibres[f].node_count; ++k) {
        const reef_fibre_node &node = work.nodes[work.fibres[f].first_node + k];
        const auto [x, y, z] = work.world(node.position);
        *next++ = {f, {x, y, z}, node.radius, k, 0, 0};
      }
    }
    check(output->commit(output->ctx, REEF_STREAM_TRACE, count));
  }

  void advance(const reef_step &input, const reef_output *output) {
    for (std::uint32_t i = 0; i < input.event_count; ++i)
      if (input.events[i].kind == REEF_EVENT_PARAM) set_param(values, input.events[i].param, input.events[i].value);
    const auto count = static_cast<std::uint32_t>(values[Count]);
    const std::uint32_t points = count * segments;
    const float height = float(values[Height]);
    const double ground = double(bed(input, values[X], values[Z]));

    auto *stalks = scratch<Stalk>(host, count);
    stand(input, count, stalks);
    float *x = scratch<float>(host, 6 * points), *y = x + points, *z = y + points;
    float *vx = z + points, *vy = vx + points, *vz = vy + points;
    for (std::uint32_t n = 0; n < count; ++n) {
      const Chain chain = grow(stalks[n], bends[n]);
      for (std::uint32_t k = 0; k < segments; ++k) {
        x[n * segments + k] = chain[k + 1][0];
        y[n * segments + k] = chain[k + 1][1];
        z[n * segments + k] = chain[k + 1][2];
      }
    }
    // All points at once, without the shelter that object 1, the forest, gives itself.
    const reef_flow_query query{x, y, z, vx, vy, vz, {values[X], ground, values[Z]}, 1, nullptr, points, 0};
    check(host->sample_flow(host->ctx, &query));

    // Room first: after this nothing can fail that leaves half a step behind.
    auto *fibres = reserve<reef_fibre>(output, REEF_STREAM_FIBRE, count * all_fibres);
    auto *nodes = reserve<reef_fibre_node>(output, REEF_STREAM_FIBRE_NODE, count * all_nodes);
    const bool wants_lines = input.flags & REEF_STEP_DEBUG;
    auto *lines = wants_lines ? offer<reef_debug_line>(output, REEF_STREAM_DEBUG_LINE, points) : nullptr;
    const float reach = height + spacing * std::sqrt(float(count));
    emit(output, REEF_STREAM_OBJECT,
         {reef_object{1, 0, {values[X], ground, values[Z]}, {0.0f, height / 2.0f, 0.0f}, reach, 0, 0}});
    emit(output, REEF_STREAM_MATERIAL,
         {reef_material{{0.30f, 0.20f, 0.05f, 1.0f}, {0.45f, 0.34f, 0.08f, 0.3f}, {}, REEF_PATTERN_NONE, 0, 0, 0, 0.2f, 0.3f,
                        0.2f, 0, 0.7f, 0.0003f, {}},
          reef_material{{0.48f, 0.36f, 0.07f, 1.0f}, {0.66f, 0.52f, 0.12f, 0.2f}, {0.26f, 0.18f, 0.03f, 0.35f},
                        REEF_PATTERN_BLOTCHES, 0, 90.0f, 0.8f, 0.85f, 0.5f, 0.3f, 0, 0.6f, 0.0003f, {}}});
    reef_flow shelter{};
    shelter.owner = 1;
    shelter.kind = REEF_FLOW_SHELTER;
    shelter.position[0] = values[X];
    shelter.position[1] = ground + double(height) / 2.0;
    shelter.position[2] = values[Z];
    shelter.strength = 0.3f;
    shelter.reach = reach;
    shelter.fade = 0.5f;
    emit(output, REEF_STREAM_FLOW, {shelter});

    // Hosts learned this later than the rest: an older table ends before it.
    if (REEF_HAS(host, figure) && host->figure) host->figure(host->ctx, "stalks", std::strlen("stalks"), count);
    Work work{*this, stalks, vx, vz, fibres, nodes, lines, {values[X], ground, values[Z]}, float(input.dt)};
    check(host->parallel_for(host->ctx, count, move_stalk, &work));
    check(output->commit(output->ctx, REEF_STREAM_FIBRE, count * all_fibres));
    check(output->commit(output->ctx, REEF_STREAM_FIBRE_NODE, count * all_nodes));
    if (lines) check(output->commit(output->ctx, REEF_STREAM_DEBUG_LINE, points));
    if (input.flags & REEF_STEP_TRACE) trace(work, output, count);
  }
};

// ---------------------------------------------------------------------------------------------- instance, descriptor

Kelp &self(void *ctx) { return *static_cast<Kelp *>(ctx); }

void destroy(void *ctx) { delete static_cast<Kelp *>(ctx); }

std::int32_t reset(void *ctx) {
  return guarded(self(ctx).host, [&] { self(ctx).reset(); });
}

std::int32_t step(void *ctx, const reef_step *input, const reef_output *output) {
  return guarded(self(ctx).host, [&] { self(ctx).step(*input, output); });
}

std::int32_t save_state(void *ctx, const reef_writer *writer) {
  return guarded(self(ctx).host, [&] { self(ctx).save(writer); });
}

std::int32_t load_state(void *ctx, const reef_reader *reader) {
  return guarded(self(ctx).host, [&] { self(ctx).load(reader); });
}

std::int32_t get_param(void *ctx, std::uint32_t id, double *out_value) {
  return guarded(self(ctx).host, [&] { *out_value = self(ctx).param(id); });
}

// The schema allows no keys, and the host has held the scene against it: the configuration says nothing.
std::int32_t create(const reef_host *host, const char *, std::uint64_t, reef_instance *out) {
  return guarded(host, [&] {
    if (!REEF_HAS(out, get_param)) throw Failed(REEF_UNSUPPORTED, "the host is too old for this plugin");
    *out = {sizeof(reef_instance), 0,          new Kelp(host), destroy,  reset,
            step,                  save_state, load_state,     get_param, nullptr};
  });
}

// What the traces are of: their kind is an index.
constexpr const char *traces[] = {"fibre"};

constexpr reef_descriptor descriptor = {
    sizeof(reef_descriptor),
    0,
    KELP_ID,
    "Kelp in C++",
    "1.0.0",
    "Reef",
    "A small forest of kelp that bends in the water, in C++.",
    R"({"type": "object", "additionalProperties": false})",
    params.data(),
    params.size(),
    state_version,
    state_version, // the oldest that load_state reads
    0,
    create,
    traces,
    1,
    0,
};

const reef_descriptor *const descriptors[] = {&descriptor};

std::int32_t open_library(const reef_host *) { return REEF_OK; }

void close_library() {}

} // namespace

extern "C" const reef_entry reef_sim_entry = {
    REEF_MAGIC, sizeof(reef_entry), REEF_VERSION, REEF_HEADER_HASH, 1, 0, descriptors, open_library, close_library,
};
