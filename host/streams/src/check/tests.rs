use std::collections::BTreeMap;

use super::*;
use crate::{STREAMS, glance};

/// Elements and nodes that one job looks at.
const ELEMENTS: usize = PIECE;
const NODES: usize = match <abi::FibreNode as Emitted>::PIECE {
    Some(piece) => piece,
    None => 0,
};

/// Those that the host takes.
fn taken() -> impl Iterator<Item = &'static Stream> {
    STREAMS.iter().filter(|stream| stream.limit.is_some())
}

fn good() -> Outputs {
    let object = |id| abi::Object { id, ..Default::default() };
    let node = |y| abi::FibreNode { position: [0.0, y, 0.0], radius: 0.01 };
    Outputs {
        objects: vec![object(1), object(2)],
        materials: vec![abi::Material::default()],
        fibres: vec![abi::Fibre {
            object: 1,
            first_node: 1,
            node_count: 2,
            sides: 8,
            flatness: 1.0,
            normal: [1.0, 0.0, 0.0],
            ..Default::default()
        }],
        fibre_nodes: vec![node(0.0), node(0.1), node(0.2)],
        billboards: vec![
            abi::Billboard { size: 0.01, flags: abi::BILLBOARD_FACING, ..Default::default() },
            abi::Billboard { object: 1, size: 0.01, axis: [0.0, 1.0, 0.0], ..Default::default() },
        ],
        flows: vec![abi::Flow { kind: abi::FLOW_SOURCE, peak: 1.0, ..Default::default() }],
        actors: vec![abi::Actor { id: 9, ..Default::default() }],
        debug_lines: vec![abi::DebugLine::default()],
        trace: vec![abi::Trace { kind: 0, ..Default::default() }],
        trace_kinds: 1,
        ..meshes::tests::good()
    }
}

fn verdict(spoil: impl FnOnce(&mut Outputs)) -> String {
    let mut outputs = good();
    spoil(&mut outputs);
    Checker::default().check(&outputs, &alone).expect_err("the spoilt outputs passed")
}

#[test]
fn good_outputs_have_elements_of_every_stream_and_pass() {
    for stream in taken() {
        let count = good().bytes(stream.number).map(|(count, _)| count);
        assert!(
            count > Some(0),
            "the good outputs of these tests have no element of the stream {}",
            stream.name
        );
    }
    assert_eq!(Checker::default().check(&good(), &alone), Ok(()));
    assert_eq!(Checker::default().check(&Outputs::default(), &alone), Ok(()));
}

#[test]
fn a_message_names_stream_element_and_field() {
    assert_eq!(
        verdict(|o| o.fibre_nodes[2].position[1] = f32::NAN),
        "stream fibre node, element 2: position is NaN, allowed is -100000 to 100000"
    );
    assert_eq!(
        verdict(|o| o.fibres[0].first_node = 2),
        "stream fibre, element 0: first_node and node_count end at 4, there are 3 nodes"
    );
    assert_eq!(verdict(|o| o.objects[1].id = 1), "stream object: two elements have the id 1");
}

#[test]
fn no_element_of_a_long_stream_is_overlooked_and_no_job_is_needed_twice() {
    let mut outputs = good();
    outputs.objects =
        (1..=2 * ELEMENTS as u64 + 1).map(|id| abi::Object { id, ..Default::default() }).collect();
    outputs.fibres = vec![outputs.fibres[0]; 2 * ELEMENTS + 1];
    outputs.fibre_nodes = vec![outputs.fibre_nodes[0]; 2 * NODES + 1];
    let check = |outputs: &Outputs| {
        let jobs = std::sync::atomic::AtomicUsize::new(0);
        let verdict = Checker::default().check(outputs, &|count, job| {
            jobs.store(count, Ordering::Relaxed);
            // Backwards: the order is nobody's promise.
            (0..count).rev().for_each(job);
        });
        (verdict, jobs.into_inner())
    };
    assert_eq!(check(&outputs), (Ok(()), 14));
    for at in [0, ELEMENTS - 1, ELEMENTS, 2 * ELEMENTS] {
        let mut spoilt = outputs.clone();
        spoilt.objects[at].bounds_radius = f32::NAN;
        let message = check(&spoilt).0.expect_err("an object passed");
        assert!(message.starts_with(&format!("stream object, element {at}: bounds_radius")), "{message}");
        let mut spoilt = outputs.clone();
        spoilt.fibres[at].sides = 0;
        let message = check(&spoilt).0.expect_err("a fibre passed");
        assert!(message.starts_with(&format!("stream fibre, element {at}: sides")), "{message}");
    }
    for at in [0, NODES - 1, NODES, 2 * NODES] {
        for axis in 0..3 {
            for wrong in [f32::NAN, f32::INFINITY, -1.01 * FARTHEST_LOCAL] {
                let mut spoilt = outputs.clone();
                spoilt.fibre_nodes[at].position[axis] = wrong;
                let message = check(&spoilt).0.expect_err("a node passed");
                assert!(
                    message.starts_with(&format!("stream fibre node, element {at}: position")),
                    "{message}"
                );
            }
        }
    }
    outputs.fibre_nodes[NODES].position = [-FARTHEST_LOCAL, FARTHEST_LOCAL, 0.0];
    assert_eq!(check(&outputs).0, Ok(()), "the bounds themselves are allowed");
}

/// Elements of which a word has each of many values in turn.
fn spoilt<T: bytemuck::Pod>(good: T) -> impl Iterator<Item = T> {
    let edges = [0.0, 1.0, f32::MIN_POSITIVE, FARTHEST_LOCAL, 1e6, f32::MAX, f32::INFINITY];
    let halves = [1.0, FARTHEST, f64::MAX, f64::INFINITY].map(|edge| (edge.to_bits() >> 32) as u32);
    let edges = edges.map(f32::to_bits).into_iter().chain(halves).chain([2, 3, 64, u32::MAX >> 1]);
    let near = |edge: u32| [edge.wrapping_sub(1), edge, edge.wrapping_add(1)];
    let values: Vec<u32> = edges.flat_map(near).flat_map(|value| [value, value | 1 << 31]).collect();
    let words = size_of::<T>() / 4;
    (0..words * values.len()).map(move |i| {
        let mut element = good;
        bytemuck::cast_slice_mut::<T, u32>(std::slice::from_mut(&mut element))[i % words] = values[i / words];
        element
    })
}

#[test]
fn the_first_look_passes_what_is_usual_and_never_what_the_second_refuses() {
    /// How often the first look had doubts and passed, of each stream.
    struct Compare(Outputs, BTreeMap<&'static str, [usize; 2]>);
    impl Visit for Compare {
        fn visit<T: Emitted>(&mut self, elements: &[T]) {
            let name = Stream::of::<T>().name;
            for element in spoilt(elements[0]) {
                let (sound, grow) = T::glance(&[element], 0, &self.0);
                let allowed = element.verdict(&self.0).is_ok() && element.unknown().is_none();
                assert!(allowed || !sound, "stream {name}: {element:?}");
                assert_eq!(grow, element.id() != Some(0), "stream {name}: {element:?}");
                self.1.entry(name).or_default()[usize::from(sound)] += 1;
            }
        }
    }
    let good = good();
    let mut compare = Compare(good.clone(), BTreeMap::new());
    good.show_all(&mut compare);
    let Compare(_, seen) = compare;
    assert_eq!(seen.len(), taken().count());
    // Words that may be anything pass with every value; of the others, some values do.
    let values = spoilt(0_u32).count();
    let passed = |stream: &str| seen[stream][1] / values;
    assert!(passed("object") >= 8 && passed("fibre") >= 2 && passed("fibre node") >= 1, "{seen:?}");
    assert!(seen.values().all(|[refused, _]| *refused > values), "{seen:?}");
    for n in spoilt(good.fibre_nodes[1]) {
        assert_eq!(glance::nodes(&[good.fibre_nodes[0], n]), glance::nodes(&[n; 6]));
    }
}

#[test]
fn what_the_header_calls_spare_is_known_of_every_stream() {
    struct Spare;
    impl Visit for Spare {
        fn visit<T: Emitted>(&mut self, _: &[T]) {
            let name = Stream::of::<T>().name;
            let mut element = T::zeroed();
            assert!(element.spare_is_zero(), "stream {name}: zero");
            bytemuck::bytes_of_mut(&mut element).fill(1);
            let has_spare = format!("{element:?}").contains("spare: ");
            assert_eq!(!element.spare_is_zero(), has_spare, "stream {name}: {element:?}");
        }
    }
    Outputs::default().show_all(&mut Spare);
}

#[test]
fn the_table_has_a_row_for_each_stream_and_names_no_two_alike() {
    for (at, stream) in STREAMS.iter().enumerate() {
        assert_eq!(stream.number as usize, at + 1);
        assert!(Stream::numbered(stream.number).is_some_and(|found| std::ptr::eq(found, stream)));
        assert!(
            STREAMS[..at].iter().all(|other| other.name != stream.name),
            "two are called {}",
            stream.name
        );
    }
    assert!(Stream::numbered(0).is_none() && Stream::numbered(abi::STREAM_COUNT).is_none());
    assert_eq!(Stream::of::<abi::Trace>().name, "trace");
    let on_request: Vec<&str> = STREAMS.iter().filter(|s| !s.is_wanted(0)).map(|s| s.name).collect();
    assert_eq!(on_request, ["debug line", "trace"]);
    assert!(Stream::of::<abi::Trace>().is_wanted(abi::STEP_TRACE));
    assert!(!Stream::of::<abi::Trace>().is_wanted(abi::STEP_DEBUG));
}

#[test]
fn what_belongs_to_an_object_goes_with_it_and_nothing_else_does() {
    let mut outputs = good();
    outputs.take_out(|object| object == 1);
    let Outputs { objects, fibres, fibre_nodes, billboards, flows, .. } = &outputs;
    assert_eq!((fibres.len(), billboards.len()), (0, 1), "of fibre and sprites, one is the first object's");
    assert_eq!((objects.len(), fibre_nodes.len(), flows.len()), (2, 3, 1));
}

#[test]
fn ids_may_come_in_any_order_but_not_twice() {
    let mut outputs = good();
    outputs.objects =
        (1..=2 * ELEMENTS as u64).rev().map(|id| abi::Object { id, ..Default::default() }).collect();
    assert_eq!(Checker::default().check(&outputs, &alone), Ok(()));
    // Twice in a row, over the border between two jobs.
    outputs.objects.reverse();
    outputs.objects[ELEMENTS].id = outputs.objects[ELEMENTS - 1].id;
    let message = Checker::default().check(&outputs, &alone).expect_err("an id passed twice");
    assert_eq!(message, format!("stream object: two elements have the id {ELEMENTS}"));
}

#[test]
fn every_kind_of_nonsense_is_refused() {
    type Spoil = fn(&mut Outputs);
    let cases: &[(&str, Spoil)] = &[
        ("object, element 0: id", |o| o.objects[0].id = 0),
        ("object, element 0: id", |o| o.objects[0].id = 1 << 48),
        ("object, element 0: origin", |o| o.objects[0].origin[2] = f64::INFINITY),
        ("object, element 1: origin", |o| o.objects[1].origin[0] = 2e6),
        ("object, element 0: bounds_radius", |o| o.objects[0].bounds_radius = -1.0),
        ("object, element 0: bounds_center", |o| o.objects[0].bounds_center[1] = f32::NAN),
        ("material, element 0: base", |o| o.materials[0].base[3] = 1.5),
        ("material, element 0: texture", |o| o.materials[0].texture = 1),
        ("material, element 0: glow", |o| o.materials[0].glow = f32::NAN),
        ("fibre node, element 0: radius", |o| o.fibre_nodes[0].radius = 0.0),
        ("fibre node, element 0: radius", |o| o.fibre_nodes[0].radius = f32::INFINITY),
        ("fibre node, element 1: position", |o| o.fibre_nodes[1].position[2] = -2e5),
        ("fibre, element 0: object", |o| o.fibres[0].object = 2),
        ("fibre, element 0: material", |o| o.fibres[0].material = 1),
        ("fibre, element 0: node_count", |o| o.fibres[0].node_count = 1),
        ("fibre, element 0: first_node", |o| o.fibres[0].first_node = u32::MAX),
        ("fibre, element 0: sides", |o| o.fibres[0].sides = 65),
        ("fibre, element 0: flatness", |o| o.fibres[0].flatness = 0.0),
        ("fibre, element 0: normal", |o| o.fibres[0].normal = [0.0; 3]),
        ("fibre, element 0: normal", |o| o.fibres[0].normal[0] = f32::NAN),
        ("skinned, element 0: mesh", |o| o.skinned[0].mesh = 0),
        ("joint, element 1: translation", |o| o.joints[1].translation[0] = f32::NAN),
        ("mesh draw, element 1: object", |o| o.mesh_draws[1].object = 2),
        ("draw vertex, element 3: position", |o| o.draw_vertices[3].position[1] = 2e5),
        ("billboard, element 0: position", |o| o.billboards[0].position[1] = f32::NAN),
        ("billboard, element 1: velocity", |o| o.billboards[1].velocity[2] = f32::INFINITY),
        ("billboard, element 0: size", |o| o.billboards[0].size = 0.0),
        ("billboard, element 0: size", |o| o.billboards[0].size = f32::INFINITY),
        ("billboard, element 1: opacity", |o| o.billboards[1].opacity = 1.01),
        ("billboard, element 1: roll", |o| o.billboards[1].roll = f32::NAN),
        ("billboard, element 1: axis", |o| o.billboards[1].axis = [0.0, 0.9, 0.0]),
        ("billboard, element 0: axis", |o| o.billboards[0].flags = 0),
        ("billboard, element 1: object", |o| o.billboards[1].object = 2),
        ("billboard, element 0: texture", |o| o.billboards[0].texture = 7),
        ("flow, element 0: peak", |o| o.flows[0].peak = 0.0),
        ("flow, element 0: axis", |o| o.flows[0].kind = abi::FLOW_DIRECTIONAL),
        ("flow, element 0: strength", |o| o.flows[0].strength = f32::NAN),
        ("flow, element 0: modulation", |o| o.flows[0].modulation = 1.1),
        ("actor, element 0: id", |o| o.actors[0].id = 0),
        ("actor, element 0: id", |o| o.actors[0].id = 1 << 48),
        ("flow, element 0: owner", |o| o.flows[0].owner = 1 << 48),
        ("actor, element 0: forward", |o| o.actors[0].forward = [0.5, 0.0, 0.0]),
        ("actor, element 0: velocity", |o| o.actors[0].velocity[0] = f32::INFINITY),
        ("debug line, element 0: channel", |o| o.debug_lines[0].channel = 32),
        ("debug line, element 0: delta", |o| o.debug_lines[0].delta[0] = f32::NAN),
        ("trace, element 0: kind", |o| o.trace[0].kind = 1),
        ("flow, element 0: flags", |o| o.flows[0].flags = 1),
        ("actor, element 0: flags", |o| o.actors[0].flags = 1 << 31),
        ("object, element 1: spare is not zero", |o| o.objects[1].spare = 1),
        ("material, element 0: spare", |o| o.materials[0].spare[9] = f32::NAN),
        ("fibre, element 0: spare", |o| o.fibres[0].spare[4] = -0.0),
        ("skinned, element 0: spare", |o| o.skinned[0].spare[4] = 1),
        ("mesh draw, element 0: spare", |o| o.mesh_draws[0].spare[1] = 1),
        ("flow, element 0: spare", |o| o.flows[0].spare[6] = 1),
        ("actor, element 0: spare", |o| o.actors[0].spare[6] = 1),
        ("debug line, element 0: spare", |o| o.debug_lines[0].spare = 1),
        ("trace, element 0: spare", |o| o.trace[0].spare = 1),
        ("trace, element 0: radius", |o| o.trace[0].radius = f32::NAN),
    ];
    for Stream { name, .. } in taken() {
        let own = cases.iter().any(|(expected, _)| expected.starts_with(&format!("{name}, element ")));
        assert!(own, "there is no case of nonsense in the stream {name}");
    }
    for (expected, spoil) in cases {
        let message = verdict(spoil);
        assert!(message.starts_with(&format!("stream {expected}")), "{expected}: {message}");
    }
}

#[test]
fn what_a_later_contract_has_is_left_out_and_told_once() {
    type Later = fn(&mut Outputs);
    let cases: &[(&str, Later)] = &[
        ("object: flags 0x1000", |o| o.objects[0].flags = abi::FLAG_NO_BLEND | 0x1000),
        ("material: pattern 0x5", |o| o.materials[0].pattern = 5),
        ("fibre: flags 0x80000000", |o| o.fibres[0].flags |= 1 << 31),
        ("skinned: flags 0x2", |o| o.skinned[0].flags |= 2),
        ("mesh draw: flags 0x400", |o| o.mesh_draws[1].flags |= 1024),
        ("billboard: flags 0x800", |o| o.billboards[1].flags |= 2048),
        ("flow: kind 0x6", |o| o.flows[0].kind = 6),
    ];
    for (told, later) in cases {
        let mut outputs = good();
        later(&mut outputs);
        let mut checker = Checker::default();
        assert_eq!(checker.check(&outputs, &alone), Ok(()), "{told}");
        let news: Vec<String> = checker.news().collect();
        assert_eq!(news, [format!("stream {told} is not known here, and left out")]);
        assert_eq!(checker.check(&outputs, &alone), Ok(()));
        assert_eq!(checker.news().count(), 0, "{told} is told twice");
    }
    let mut checker = Checker::default();
    for bit in 1..31 {
        let mut outputs = good();
        outputs.objects[0].flags = 1 << bit;
        assert_eq!(checker.check(&outputs, &alone), Ok(()));
    }
    assert_eq!(checker.news().count(), MOST_UNKNOWN);
}
