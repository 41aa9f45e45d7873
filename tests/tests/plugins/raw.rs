//! Plugins that break the contract in ways that the SDK does not allow: entries linked into this test,
//! stepped by the host.

use std::{
    ffi::{CString, c_char, c_void},
    ptr,
};

use reef_abi as abi;
use reef_plugin::{Health, Library, PluginError, Refusal, StepStatus};
use reef_tests::sea::Sea;

/// What an instance of this file does in its step.
type Step = fn(host: &abi::Host, output: &abi::Output) -> i32;

struct Raw {
    host: *const abi::Host,
    step: Step,
}

unsafe extern "C" fn open(_: *const abi::Host) -> i32 {
    abi::OK
}

unsafe extern "C" fn close() {}

unsafe extern "C" fn destroy(ctx: *mut c_void) {
    // SAFETY: made in `create`, destroyed once.
    drop(unsafe { Box::from_raw(ctx.cast::<Raw>()) });
}

unsafe extern "C" fn step(ctx: *mut c_void, _: *const abi::Step, output: *const abi::Output) -> i32 {
    // SAFETY: made in `create`; the host's pointers live during the call.
    unsafe {
        let raw = &*ctx.cast::<Raw>();
        (raw.step)(&*raw.host, &*output)
    }
}

/// The configuration is a number: which of the `STEPS`; beyond them: those of `MORE`.
unsafe extern "C" fn create(
    host: *const abi::Host,
    config: *const c_char,
    length: u64,
    out: *mut abi::Instance,
) -> i32 {
    // SAFETY: the host's text and its place for the instance.
    unsafe {
        let text = std::slice::from_raw_parts(config.cast::<u8>(), length as usize);
        let index: usize = std::str::from_utf8(text).unwrap().parse().unwrap();
        let does = STEPS.get(index).map_or_else(|| MORE[index - STEPS.len()], |step| step.1);
        let raw = Box::new(Raw { host, step: does });
        (*out).ctx = Box::into_raw(raw).cast();
        (*out).destroy = Some(destroy);
        (*out).step = Some(step);
    }
    abi::OK
}

fn leaked(text: &str) -> *const c_char {
    CString::new(text).unwrap().into_raw()
}

fn descriptor() -> abi::Descriptor {
    abi::Descriptor {
        size: size_of::<abi::Descriptor>() as u32,
        flags: 0,
        id: leaked("fixture.raw"),
        name: leaked("Raw"),
        version: leaked("1.0.0"),
        vendor: leaked("Reef's tests"),
        description: leaked("Breaks the contract."),
        config_schema: ptr::null(),
        params: ptr::null(),
        param_count: 0,
        state_version: 0,
        state_min_version: 0,
        spare: 0,
        create: Some(create),
        traces: ptr::null(),
        trace_count: 0,
        spare_traces: 0,
    }
}

fn entry(descriptor: abi::Descriptor) -> abi::Entry {
    let descriptors: &'static [*const abi::Descriptor; 1] =
        Box::leak(Box::new([&raw const *Box::leak(Box::new(descriptor))]));
    abi::Entry {
        magic: abi::MAGIC,
        size: size_of::<abi::Entry>() as u32,
        version: abi::VERSION,
        header_hash: abi::HEADER_HASH,
        descriptor_count: 1,
        spare: 0,
        descriptors: descriptors.as_ptr(),
        open: Some(open),
        close: Some(close),
    }
}

fn leak(entry: abi::Entry) -> &'static abi::Entry {
    Box::leak(Box::new(entry))
}

fn refusal(entry: abi::Entry) -> String {
    match Library::from_entry(leak(entry), 1) {
        Ok(_) => panic!("it was accepted"),
        Err(refusal) => refusal.to_string(),
    }
}

fn reserve(output: &abi::Output, stream: u32, size: u32, count: u64) -> i32 {
    let mut out = ptr::null_mut();
    // SAFETY: the host checks its arguments.
    unsafe { output.reserve.unwrap()(output.ctx, stream, size, count, &mut out) }
}

fn commit(output: &abi::Output, stream: u32, count: u64) -> i32 {
    // SAFETY: the host checks its arguments.
    unsafe { output.commit.unwrap()(output.ctx, stream, count) }
}

/// One texel.
const SPECK: abi::Texture = abi::Texture {
    texels: (&raw const TEXEL).cast(),
    format: abi::TEXTURE_RGBA8,
    width: 1,
    height: 1,
    spare: [0; 3],
    name: c"speck".as_ptr(),
};
static TEXEL: [u8; 4] = [0; 4];

fn texture(host: &abi::Host, texture: &abi::Texture) -> i32 {
    // SAFETY: the host checks its arguments.
    unsafe { host.texture_create.unwrap()(host.ctx, texture, &mut 0) }
}

/// Each breaks a rule, ignores the status, and returns REEF_OK; the step's message contains the text.
const STEPS: [(&str, Step); 21] = [
    ("stream fibre node: elements of 12 bytes; they have 16", |_, output| {
        assert_eq!(reserve(output, abi::STREAM_FIBRE_NODE, 12, 3), abi::BAD_INPUT);
        abi::OK
    }),
    ("stream object: committed without reserve", |_, output| {
        assert_eq!(commit(output, abi::STREAM_OBJECT, 0), abi::BAD_INPUT);
        abi::OK
    }),
    ("stream object: 3 elements committed, 2 reserved", |_, output| {
        assert_eq!(reserve(output, abi::STREAM_OBJECT, 64, 2), abi::OK);
        assert_eq!(commit(output, abi::STREAM_OBJECT, 3), abi::BAD_INPUT);
        abi::OK
    }),
    ("stream flow: 16385 elements; the limit is 16384", |_, output| {
        assert_eq!(reserve(output, abi::STREAM_FLOW, 128, 16_385), abi::NO_SPACE);
        abi::OK
    }),
    ("stream trace: 18446744073709551615 elements", |_, output| {
        assert_eq!(reserve(output, abi::STREAM_TRACE, 48, u64::MAX), abi::NO_SPACE);
        abi::OK
    }),
    ("stream object, element 0: spare is not zero", |_, output| {
        let mut out = ptr::null_mut();
        // SAFETY: as much room as was asked for.
        unsafe {
            output.reserve.unwrap()(output.ctx, abi::STREAM_OBJECT, 64, 1, &mut out);
            out.cast::<abi::Object>().write(abi::Object { id: 1, spare: 7, ..abi::Object::default() });
        }
        commit(output, abi::STREAM_OBJECT, 1)
    }),
    ("reserve: the result's place is NULL", |_, output| {
        // SAFETY: the host checks its arguments.
        let status =
            unsafe { output.reserve.unwrap()(output.ctx, abi::STREAM_OBJECT, 64, 1, ptr::null_mut()) };
        assert_eq!(status, abi::BAD_INPUT);
        abi::OK
    }),
    ("stream object, element 0: id is 0", |_, output| {
        // Room that was committed but never written holds zeros.
        reserve(output, abi::STREAM_OBJECT, 64, 1);
        commit(output, abi::STREAM_OBJECT, 1)
    }),
    ("unknown status 77", |_, _| 77),
    ("it gave no reason", |_, _| abi::ERROR),
    ("mesh_create: the mesh or its id's place is NULL or misaligned", |host, _| {
        let mut id = 0;
        // SAFETY: the host checks its arguments.
        unsafe { host.mesh_create.unwrap()(host.ctx, ptr::null(), &mut id) }
    }),
    ("texture_create: the texture or its id's place is NULL", |host, _| {
        // SAFETY: the host checks its arguments.
        unsafe { host.texture_create.unwrap()(host.ctx, ptr::null(), &mut 0) }
    }),
    ("texture_create: `speck`: its texels are NULL", |host, _| {
        texture(host, &abi::Texture { texels: ptr::null(), ..SPECK })
    }),
    ("texture_create: `speck`: 1025 x 1 texels, allowed is 1 to 1024", |host, _| {
        texture(host, &abi::Texture { width: 1025, ..SPECK })
    }),
    ("texture_create: `speck`: spare is not zero", |host, _| {
        texture(host, &abi::Texture { spare: [0, 0, 1], ..SPECK })
    }),
    ("texture_create: ``: the format is 0", |host, _| {
        texture(host, &abi::Texture { format: 0, name: ptr::null(), ..SPECK })
    }),
    ("texture_create: `speck`: the instance has 64 textures, which is the limit", |host, _| {
        for i in 0..64_u8 {
            let texels = [i; 4];
            assert_eq!(texture(host, &abi::Texture { texels: texels.as_ptr().cast(), ..SPECK }), abi::OK);
        }
        assert_eq!(texture(host, &SPECK), abi::OK, "the first again needs no room");
        texture(host, &abi::Texture { texels: [99_u8; 4].as_ptr().cast(), ..SPECK })
    }),
    ("texture_destroy: the instance has no texture 5", |host, _| {
        // SAFETY: the host checks its arguments.
        unsafe { host.texture_destroy.unwrap()(host.ctx, 5) }
    }),
    ("stream billboard, element 0: texture is 1, which texture_create did not hand out", |_, output| {
        let mut out = ptr::null_mut();
        reserve(output, abi::STREAM_OBJECT, 64, 1);
        // SAFETY: as much room as was asked for.
        unsafe {
            output.reserve.unwrap()(output.ctx, abi::STREAM_OBJECT, 64, 1, &mut out);
            out.cast::<abi::Object>().write(abi::Object { id: 1, ..abi::Object::default() });
            output.reserve.unwrap()(output.ctx, abi::STREAM_BILLBOARD, 64, 1, &mut out);
            let sprite = abi::Billboard { size: 1.0, texture: 1, ..abi::Billboard::default() };
            out.cast::<abi::Billboard>().write(abi::Billboard { axis: [0.0, 1.0, 0.0], ..sprite });
        }
        commit(output, abi::STREAM_OBJECT, 1);
        commit(output, abi::STREAM_BILLBOARD, 1)
    }),
    ("scratch: 9 bytes aligned to 3", |host, _| {
        let mut out = ptr::null_mut();
        // SAFETY: the host checks its arguments.
        unsafe { host.scratch.unwrap()(host.ctx, 9, 3, &mut out) }
    }),
    ("parallel_for: the job is NULL", |host, _| {
        // SAFETY: the host checks its arguments.
        unsafe { host.parallel_for.unwrap()(host.ctx, 9, None, ptr::null_mut()) }
    }),
];

#[test]
fn each_broken_rule_fails_its_step_with_a_message_though_the_plugin_says_ok() {
    let (_, plugins) = Library::from_entry(leak(entry(descriptor())), 2).unwrap();
    let sea = Sea::default();
    for (i, (expected, _)) in STEPS.iter().enumerate() {
        let mut instance = plugins[0].create(&i.to_string()).unwrap();
        let report = instance.step(&sea.input(1), &[]);
        assert_eq!(report.status, StepStatus::Failed, "{expected}");
        let message = report.message.unwrap();
        assert!(message.contains(expected), "{message:?} should contain {expected:?}");
        assert_ne!(instance.health(), &Health::Running);
    }
}

/// Steps that break no rule.
const MORE: [Step; 2] = [figures, later];

/// Asks for what a later contract may have.
fn later(host: &abi::Host, output: &abi::Output) -> i32 {
    for stream in [abi::STREAM_COUNT, 99, u32::MAX] {
        assert_eq!(reserve(output, stream, 64, 1), abi::UNSUPPORTED);
        assert_eq!(commit(output, stream, 1), abi::UNSUPPORTED);
    }
    assert_eq!(texture(host, &abi::Texture { format: 3, ..SPECK }), abi::UNSUPPORTED);
    let mut out = ptr::null_mut();
    // SAFETY: as much room as was asked for.
    unsafe {
        output.reserve.unwrap()(output.ctx, abi::STREAM_FLOW, 128, 1, &mut out);
        out.cast::<abi::Flow>().write(abi::Flow { kind: 77, ..abi::Flow::default() });
    }
    commit(output, abi::STREAM_FLOW, 1)
}

#[test]
fn a_step_goes_on_without_what_only_a_later_contract_has() {
    let (_, plugins) = Library::from_entry(leak(entry(descriptor())), 1).unwrap();
    let mut instance = plugins[0].create(&(STEPS.len() + 1).to_string()).unwrap();
    for step in 1..3 {
        let report = instance.step(&Sea::default().input(step), &[]);
        assert_eq!((report.status, report.message), (StepStatus::Ok, None));
    }
    assert_eq!(instance.health(), &Health::Running);
    assert_eq!(instance.outputs().flows[0].kind, 77, "whoever knows it gets it");
}

#[test]
fn what_an_instance_does_not_offer_is_an_error_by_name() {
    let (_, plugins) = Library::from_entry(leak(entry(descriptor())), 1).unwrap();
    let mut instance = plugins[0].create("0").unwrap();
    let error = instance.save().unwrap_err();
    assert!(matches!(&error, PluginError::Call { call: "save_state", .. }), "{error}");
    assert!(error.to_string().contains("does not offer it"), "{error}");
    assert!(instance.reset().is_err() && instance.param(1).is_err());
}

#[test]
fn entries_that_describe_themselves_wrongly_are_refused() {
    let good = || (entry(descriptor()), descriptor());
    let (mut e, _) = good();
    e.magic ^= 1;
    assert!(refusal(e).contains("REEF_MAGIC"));
    let (mut e, _) = good();
    e.version = 5 << 16;
    assert!(refusal(e).contains("reef_sim.h 5.0"));
    let (mut e, _) = good();
    e.header_hash ^= 1;
    assert!(refusal(e).contains("another reef_sim.h"));
    let (mut e, _) = good();
    e.open = None;
    assert!(refusal(e).contains("open or close is NULL"));
    for count in [0, 65] {
        let (mut e, _) = good();
        e.descriptor_count = count;
        assert!(refusal(e).contains(&format!("it has {count} plugins; allowed is 1 to 64")));
    }
    let (mut e, _) = good();
    e.descriptors = ptr::null();
    assert!(refusal(e).contains("list of descriptors is NULL"));
    let null: &'static [*const abi::Descriptor; 1] = Box::leak(Box::new([ptr::null()]));
    e.descriptors = null.as_ptr();
    assert!(refusal(e).contains("descriptor 0 is NULL"));

    let (_, mut d) = good();
    d.id = leaked("Not An Id");
    assert!(refusal(entry(d)).contains("must be like `vendor.name`"));
    d.id = ptr::null();
    assert!(refusal(entry(d)).contains("its id is NULL"));
    let (_, mut d) = good();
    d.name = c"\xff\xfe".as_ptr();
    assert!(refusal(entry(d)).contains("its name is not UTF-8"));
    let (_, mut d) = good();
    d.config_schema = leaked("{not json");
    assert!(refusal(entry(d)).contains("config_schema is no JSON"));
    let (_, mut d) = good();
    d.param_count = 1;
    assert!(refusal(entry(d)).contains("params are NULL"));
    let (_, mut d) = good();
    d.create = None;
    assert!(refusal(entry(d)).contains("create is NULL"));
    let (_, mut d) = good();
    d.size = 8; // A descriptor that ends before its id.
    assert!(refusal(entry(d)).contains("its id is NULL"));

    let (mut e, _) = good();
    e.spare = 9;
    assert!(refusal(e).contains("its spare field is 0x9, allowed is 0"));
    let spoilt: [fn(&mut abi::Descriptor); 3] = [|d| d.flags = 1, |d| d.spare = 1, |d| d.spare_traces = 1];
    for spoil in spoilt {
        let (_, mut d) = good();
        spoil(&mut d);
        assert!(refusal(entry(d)).contains("its flags and spare fields are ["));
    }
    let names = |names: &[&str]| {
        let list: Vec<_> = names.iter().map(|name| leaked(name)).collect();
        let (_, mut d) = good();
        (d.traces, d.trace_count) = (list.leak().as_ptr().cast(), names.len() as u32);
        d
    };
    assert_eq!(Library::from_entry(leak(entry(names(&["fish", "whale_song2"]))), 1).map(|_| ()), Ok(()));
    assert!(refusal(entry(names(&["fish", "fish"]))).contains("two of its traces are called \"fish\""));
    assert!(refusal(entry(names(&["Fish"]))).contains("its trace \"Fish\" must be of a-z"));
    assert!(refusal(entry(names(&["fish"; 17]))).contains("it has 17 trace names; the limit is 16"));
    let mut d = names(&["fish"]);
    d.traces = ptr::null();
    assert!(refusal(entry(d)).contains("its trace names are NULL or misaligned"));
}

#[test]
fn parameters_that_make_no_sense_are_refused() {
    type Change = fn(&mut abi::Param);
    let param = |change: Change| {
        let mut param = abi::Param {
            id: 1,
            kind: abi::PARAM_FLOAT,
            flags: 0,
            choice_count: 0,
            minimum: 0.0,
            maximum: 1.0,
            default_value: 0.5,
            key: leaked("size"),
            label: leaked("Size"),
            group: leaked(""),
            unit: leaked("m"),
            help: leaked("How large."),
            choices: ptr::null(),
            spare: [0; 2],
        };
        change(&mut param);
        let params: &'static [abi::Param; 1] = Box::leak(Box::new([param]));
        let mut d = descriptor();
        d.params = params.as_ptr();
        d.param_count = 1;
        Library::from_entry(leak(entry(d)), 1).map(|(library, _)| library.notes().to_vec())
    };
    assert_eq!(param(|_| {}), Ok(vec![]));
    let later = |change: Change| param(change).unwrap().join("; ");
    assert!(later(|p| p.kind = 9).contains("parameter 1: its kind 9 is not known here, and left out"));
    assert!(later(|p| p.flags = 4).contains("parameter `size`: its flags 0x4 are not known here"));
    let cases: [(&str, Change); 6] = [
        ("its id is 0", |p| p.id = 0),
        ("its spare fields are [0, 7]", |p| p.spare[1] = 7),
        ("outside of its range", |p| p.default_value = 2.0),
        ("outside of its range", |p| p.maximum = f64::NAN),
        ("range above 0", |p| p.flags = abi::PARAM_LOG),
        ("a choice needs its names", |p| p.kind = abi::PARAM_CHOICE),
    ];
    for (expected, change) in cases {
        match param(change) {
            Err(Refusal::BadDescriptor(message)) => assert!(message.contains(expected), "{message}"),
            other => panic!("{expected}: {other:?}"),
        }
    }
}

/// Shows figures of all kinds.
fn figures(host: &abi::Host, _: &abi::Output) -> i32 {
    let tell = |name: &[u8], value: f64| {
        // SAFETY: a living name.
        unsafe { host.figure.unwrap()(host.ctx, name.as_ptr().cast(), name.len() as u64, value) }
    };
    tell(b"first", 1.0);
    tell(b"first", 2.0);
    tell(&[b'x'; 64], 64.0);
    tell(&[b'x'; 65], 65.0);
    tell(&[0xff, 0xfe], 3.0);
    // SAFETY: NULL is no name.
    unsafe { host.figure.unwrap()(host.ctx, ptr::null(), 5, 4.0) };
    for i in 0..40 {
        tell(format!("more {i}").as_bytes(), f64::from(i));
    }
    abi::OK
}

#[test]
fn figures_keep_their_last_value_and_what_is_beyond_the_limits_is_not_kept() {
    let (_, plugins) = Library::from_entry(leak(entry(descriptor())), 2).unwrap();
    let last = STEPS.len();
    let mut instance = plugins[0].create(&last.to_string()).unwrap();
    for number in 1..3 {
        assert_eq!(instance.step(&Sea::default().input(number), &[]).status, StepStatus::Ok);
        let figures = instance.figures();
        assert_eq!(figures.len(), 32);
        assert_eq!(figures[0], ("first".to_owned(), 2.0));
        assert_eq!(figures[1], ("x".repeat(64), 64.0));
        assert_eq!(figures[31], ("more 29".to_owned(), 29.0));
    }
}
