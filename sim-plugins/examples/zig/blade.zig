// SPDX-License-Identifier: MIT OR Apache-2.0
//
// A plugin in Zig: one stalk that leans with the water. The contract comes from its header:
//
//   zig translate-c -DREEF_NO_ASSERTS -DREEF_EXPORT= reef_sim.h > reef_sim.zig
//   zig build-lib -dynamic -O ReleaseSmall blade.zig
//
// Without libc: the host lends all memory but that of the instance itself.
const std = @import("std");
const reef = @import("reef_sim.zig");

/// How functions of the contract are called, by whichever name this compiler has for it.
const cc: std.builtin.CallingConvention =
    if (@hasDecl(std.builtin.CallingConvention, "c")) .c else .C;

const nodes = 9;
const segments = nodes - 1;
/// Square of the speed whose drag equals the lift [m2/s2].
const lift: f32 = 0.02;
/// How slowly it follows the water [s].
const delay: f32 = 0.7;
/// Most by which it leans, as a slope.
const most_lean: f32 = 1000.0;

const height_id = 1;
const params = [_]reef.reef_param{.{
    .id = height_id,
    .kind = reef.REEF_PARAM_FLOAT,
    .minimum = 0.2,
    .maximum = 5.0,
    .default_value = 1.2,
    .key = "height",
    .label = "Height",
    .group = "Stalk",
    .unit = "m",
    .help = "Length of the stalk.",
}};

/// One module of a scene.
const Blade = struct {
    host: *const reef.reef_host,
    /// Slope along x and z.
    lean: [2]f32 = .{ 0.0, 0.0 },
    /// [m]
    height: f64 = params[0].default_value,
};

fn of(ctx: ?*anyopaque) *Blade {
    return @ptrCast(@alignCast(ctx.?));
}

fn fail(host: *const reef.reef_host, status: i32, message: []const u8) i32 {
    host.set_error.?(host.ctx, message.ptr, message.len);
    return status;
}

/// Reserves, copies and commits what is known at once.
fn emit(output: *const reef.reef_output, stream: u32, comptime T: type, elements: []const T) i32 {
    var room: ?*anyopaque = null;
    const status = output.reserve.?(output.ctx, stream, @sizeOf(T), elements.len, &room);
    if (status != reef.REEF_OK) return status;
    const to: [*]T = @ptrCast(@alignCast(room.?));
    @memcpy(to[0..elements.len], elements);
    return output.commit.?(output.ctx, stream, elements.len);
}

/// Emits several streams, one after the other, until one is refused.
fn emitAll(output: *const reef.reef_output, streams: anytype) i32 {
    inline for (streams) |stream| {
        const status = emit(output, stream[0], stream[1], stream[2]);
        if (status != reef.REEF_OK) return status;
    }
    return reef.REEF_OK;
}

/// The chain from its root, relative to the origin: a straight stalk.
fn grow(self: *const Blade) [nodes]reef.reef_fibre_node {
    const lean = self.lean;
    const length = @as(f32, @floatCast(self.height)) / segments;
    const rise = length / @sqrt(1.0 + lean[0] * lean[0] + lean[1] * lean[1]);
    var chain: [nodes]reef.reef_fibre_node = undefined;
    for (&chain, 0..) |*node, k| {
        const up = rise * @as(f32, @floatFromInt(k));
        node.* = .{ .position = .{ lean[0] * up, up, lean[1] * up }, .radius = 0.02 };
    }
    return chain;
}

fn advance(self: *Blade, input: *const reef.reef_step, output: *const reef.reef_output) i32 {
    const host = self.host;
    for (0..input.event_count) |i| {
        const event = input.events[i];
        const is_height = event.kind == reef.REEF_EVENT_PARAM and event.param == height_id;
        if (is_height and !std.math.isNan(event.value)) {
            self.height = @min(@max(event.value, params[0].minimum), params[0].maximum);
        }
    }
    // The water at the tip, without what the stalk does to it.
    const origin = [3]f64{ 0.0, -@as(f64, input.water.*.depth), 0.0 };
    const tip = grow(self)[nodes - 1].position;
    var water = [3]f32{ 0.0, 0.0, 0.0 };
    const query = reef.reef_flow_query{
        .x = &tip[0],
        .y = &tip[1],
        .z = &tip[2],
        .vx = &water[0],
        .vy = &water[1],
        .vz = &water[2],
        .origin = origin,
        .owner = 1,
        .count = 1,
    };
    const status = host.sample_flow.?(host.ctx, &query);
    if (status != reef.REEF_OK) return status;

    const speed = @sqrt(water[0] * water[0] + water[2] * water[2]);
    const dt: f32 = @floatCast(input.dt);
    const share = dt / (delay + dt);
    for (&self.lean, [2]f32{ water[0], water[2] }) |*lean, along| {
        const target = @min(@max(speed * along / lift, -most_lean), most_lean);
        lean.* += share * (target - lean.*);
    }

    const height: f32 = @floatCast(self.height);
    const object = [1]reef.reef_object{.{
        .id = 1,
        .origin = origin,
        .bounds_radius = height + 0.1,
    }};
    const felt = emit(output, reef.REEF_STREAM_OBJECT, reef.reef_object, &object);
    // What only shows stays out of a step that nobody looks at.
    if (felt != reef.REEF_OK or input.flags & reef.REEF_STEP_UNSEEN != 0) return felt;
    const material = [1]reef.reef_material{.{
        .base = .{ 0.1, 0.3, 0.1, 1.0 },
        .tip = .{ 0.3, 0.6, 0.1, 0.5 },
        .roughness = 0.7,
        .specular = 0.0003,
    }};
    const fibre = [1]reef.reef_fibre{.{
        .node_count = nodes,
        .sides = 8,
        .flatness = 1.0,
        .normal = .{ 1.0, 0.0, 0.0 },
    }};
    const chain = grow(self);
    return emitAll(output, .{
        .{ reef.REEF_STREAM_MATERIAL, reef.reef_material, &material },
        .{ reef.REEF_STREAM_FIBRE, reef.reef_fibre, &fibre },
        .{ reef.REEF_STREAM_FIBRE_NODE, reef.reef_fibre_node, &chain },
    });
}

/// A step that fails leaves everything as it was.
fn step(
    ctx: ?*anyopaque,
    input: [*c]const reef.reef_step,
    output: [*c]const reef.reef_output,
) callconv(cc) i32 {
    const self = of(ctx);
    const before = self.*;
    const status = advance(self, input, output);
    if (status != reef.REEF_OK) self.* = before;
    return status;
}

/// What a saved state holds, and the word that it begins with.
const Saved = extern struct { begin: u64 = blade, lean: [2]f32, height: f64 };
const blade: u64 = 0x6564616c62; // "blade"

fn saveState(ctx: ?*anyopaque, writer: [*c]const reef.reef_writer) callconv(cc) i32 {
    const self = of(ctx);
    const saved = Saved{ .lean = self.lean, .height = self.height };
    return writer.*.write.?(writer.*.ctx, &saved, @sizeOf(Saved));
}

fn loadState(ctx: ?*anyopaque, reader: [*c]const reef.reef_reader) callconv(cc) i32 {
    const self = of(ctx);
    var saved: Saved = undefined;
    const bytes = std.mem.asBytes(&saved);
    var done: usize = 0;
    while (done < bytes.len) {
        const count = reader.*.read.?(reader.*.ctx, &bytes[done], bytes.len - done);
        if (count <= 0) return fail(self.host, reef.REEF_BAD_STATE, "the state ends too early");
        done += @intCast(count);
    }
    var more: u8 = 0;
    const ends = reader.*.read.?(reader.*.ctx, &more, 1) == 0;
    if (!ends or saved.begin != blade or reader.*.state_version != descriptor.state_version) {
        return fail(self.host, reef.REEF_BAD_STATE, "the state is not of this plugin and version");
    }
    for (saved.lean) |lean| {
        if (!(@abs(lean) <= most_lean)) return fail(self.host, reef.REEF_BAD_STATE, "it leans too far");
    }
    if (!(saved.height >= params[0].minimum and saved.height <= params[0].maximum)) {
        return fail(self.host, reef.REEF_BAD_STATE, "its height is out of its range");
    }
    self.lean = saved.lean;
    self.height = saved.height;
    return reef.REEF_OK;
}

fn getParam(ctx: ?*anyopaque, id: u32, value: [*c]f64) callconv(cc) i32 {
    const self = of(ctx);
    if (id != height_id) return fail(self.host, reef.REEF_BAD_INPUT, "there is no such parameter");
    value.* = self.height;
    return reef.REEF_OK;
}

fn reset(ctx: ?*anyopaque) callconv(cc) i32 {
    const self = of(ctx);
    self.* = .{ .host = self.host };
    return reef.REEF_OK;
}

fn destroy(ctx: ?*anyopaque) callconv(cc) void {
    std.heap.page_allocator.destroy(of(ctx));
}

fn create(
    host: [*c]const reef.reef_host,
    config: [*c]const u8,
    length: u64,
    out: [*c]reef.reef_instance,
) callconv(cc) i32 {
    // The schema allows no keys, and the host has held the scene against it.
    _ = config;
    _ = length;
    const needed = @offsetOf(reef.reef_instance, "get_param") + @sizeOf(*anyopaque);
    if (out.*.size < needed) return fail(host, reef.REEF_UNSUPPORTED, "the host is too old for this plugin");
    const self = std.heap.page_allocator.create(Blade) catch
        return fail(host, reef.REEF_NO_SPACE, "there is no memory for the stalk");
    self.* = .{ .host = host };
    const instance = reef.reef_instance{
        .size = @sizeOf(reef.reef_instance),
        .ctx = self,
        .destroy = destroy,
        .reset = reset,
        .step = step,
        .save_state = saveState,
        .load_state = loadState,
        .get_param = getParam,
    };
    // No more than the host has room for.
    const size = @min(out.*.size, instance.size);
    const to: [*]u8 = @ptrCast(out);
    @memcpy(to[0..size], std.mem.asBytes(&instance)[0..size]);
    out.*.size = size;
    return reef.REEF_OK;
}

const descriptor = reef.reef_descriptor{
    .size = @sizeOf(reef.reef_descriptor),
    .id = "example.blade-zig",
    .name = "Blade in Zig",
    .version = "1.0.0",
    .vendor = "Reef",
    .description = "One stalk that leans with the water, in Zig.",
    .config_schema = "{\"type\": \"object\", \"additionalProperties\": false}",
    .params = &params,
    .param_count = params.len,
    .state_version = 1,
    .state_min_version = 1,
    .create = create,
};

const descriptors = [_][*c]const reef.reef_descriptor{&descriptor};

fn open(host: [*c]const reef.reef_host) callconv(cc) i32 {
    _ = host;
    return reef.REEF_OK;
}

fn close() callconv(cc) void {}

export const reef_sim_entry = reef.reef_entry{
    .magic = reef.REEF_MAGIC,
    .size = @sizeOf(reef.reef_entry),
    .version = reef.REEF_VERSION,
    .header_hash = reef.REEF_HEADER_HASH,
    .descriptor_count = descriptors.len,
    .descriptors = &descriptors,
    .open = open,
    .close = close,
};
