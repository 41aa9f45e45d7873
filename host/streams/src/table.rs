//! The table of streams: which there are, what each is called, what it is made of, and how much of it a step
//! may emit. What the host does with all of them follows from the table: memory, limits, checks, hashes.

use bytemuck::Pod;
use reef_abi::{self as abi, Element};

use crate::{Lane, check::Emitted, meshes::MeshList, textures::TextureList};

/// One stream of the contract.
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    /// `abi::STREAM_*`.
    pub number: u32,
    /// For messages.
    pub name: &'static str,
    /// Most elements that one instance may emit in one step; None: this host does not take the stream.
    pub limit: Option<u64>,
    /// The flag of a step (`abi::STEP_*`) that asks for it; 0: it is always wanted, and part of hashes.
    pub asked_by: u32,
    /// Only pictures need it: it may stay out of a step that nobody looks at (`abi::STEP_UNSEEN`).
    pub shows: bool,
}

impl Stream {
    /// The stream with this number.
    pub fn numbered(number: u32) -> Option<&'static Self> {
        STREAMS.get((number as usize).checked_sub(1)?)
    }

    /// The stream of these elements.
    pub fn of<T: Element>() -> &'static Self {
        &STREAMS[T::STREAM as usize - 1]
    }

    /// Whether a step with these flags wants it.
    pub fn is_wanted(&self, flags: u32) -> bool {
        self.asked_by == ALWAYS || flags & self.asked_by != 0
    }
}

/// Looks at streams, whatever they are made of.
pub trait Visit {
    /// Looks at the elements of one.
    fn visit<T: Emitted>(&mut self, elements: &[T]);
}

/// See [`Stream::asked_by`].
const ALWAYS: u32 = 0;
/// See [`Stream::shows`].
const SHOWN: bool = true;
const FELT: bool = false;
/// How many streams the contract has.
const COUNT: usize = abi::STREAM_COUNT as usize - 1;

macro_rules! streams {
    (
        taken { $($(#[$about:meta])* $field:ident: $element:ty, $name:literal, $limit:expr, $asked_by:expr, $shows:expr;)+ }
        declared { $($declared:ty, $declared_name:literal;)* }
    ) => {
        /// All streams of the contract, in the order of their numbers.
        pub static STREAMS: [Stream; COUNT] = sorted(&[
            $(Stream {
                number: <$element>::STREAM, name: $name, limit: Some($limit), asked_by: $asked_by, shows: $shows
            },)+
            $(Stream {
                number: <$declared>::STREAM, name: $declared_name, limit: None, asked_by: ALWAYS, shows: false
            },)*
        ]);

        /// The committed outputs of one instance in one step. Indices in the elements (object, material,
        /// first_node …) refer to the vectors beside them and have been checked to lie inside them.
        #[derive(Clone, Debug, Default)]
        pub struct Outputs {
            $($(#[$about])* pub $field: Vec<$element>,)+
            /// What the instance had made with `texture_create` at the end of the step.
            pub textures: TextureList,
            /// What it had made with `mesh_create`.
            pub meshes: MeshList,
            /// How many kinds of traces its plugin names.
            pub trace_kinds: u32,
        }

        impl Outputs {
            /// Shows a stream to `visitor`, if the host takes it.
            pub fn show(&self, stream: u32, visitor: &mut impl Visit) {
                match stream {
                    $(<$element as Element>::STREAM => visitor.visit(&self.$field[..]),)+
                    _ => {}
                }
            }

            /// A stream as count and bytes; None: the host does not take it.
            pub fn bytes(&self, stream: u32) -> Option<(usize, &[u8])> {
                Some(match stream {
                    $(<$element as Element>::STREAM => counted(&self.$field),)+
                    _ => return None,
                })
            }

            /// The memory of a stream; None: the host does not take it.
            pub fn lane(&mut self, stream: u32) -> Option<&mut dyn Lane> {
                Some(match stream {
                    $(<$element as Element>::STREAM => &mut self.$field,)+
                    _ => return None,
                })
            }

            /// Takes out what belongs to objects of which `gone`, asked with their index, says yes. The
            /// objects themselves stay.
            pub fn take_out(&mut self, gone: impl Fn(u32) -> bool) {
                $(self.$field.retain(|element| !element.object().is_some_and(&gone));)+
            }
        }
    };
}

streams! {
    // Field, element, name, limit, when it is wanted, what needs it.
    taken {
        /// Things in the sea: what all other elements belong to.
        objects: abi::Object, "object", 1 << 20, ALWAYS, FELT;
        /// How surfaces look.
        materials: abi::Material, "material", 1 << 12, ALWAYS, SHOWN;
        /// Node chains.
        fibres: abi::Fibre, "fibre", 1 << 20, ALWAYS, SHOWN;
        /// Nodes of all chains, relative to their object's origin.
        fibre_nodes: abi::FibreNode, "fibre node", 1 << 24, ALWAYS, SHOWN;
        /// Meshes that joints move.
        skinned: abi::Skinned, "skinned", 1 << 20, ALWAYS, SHOWN;
        /// Joints of all of them, relative to their object's origin.
        joints: abi::Joint, "joint", 1 << 24, ALWAYS, SHOWN;
        /// Meshes whose vertices are made anew.
        mesh_draws: abi::MeshDraw, "mesh draw", 1 << 12, ALWAYS, SHOWN;
        /// Vertices of all of them, relative to their object's origin.
        draw_vertices: abi::DrawVertex, "draw vertex", 1 << 23, ALWAYS, SHOWN;
        /// Sprites, relative to their object's origin, in no order that means anything.
        billboards: abi::Billboard, "billboard", 1 << 22, ALWAYS, SHOWN;
        /// What this instance does to the water: everything in the sea pays for it.
        flows: abi::Flow, "flow", 1 << 14, ALWAYS, FELT;
        /// What others may perceive.
        actors: abi::Actor, "actor", 1 << 18, ALWAYS, FELT;
        /// Drawn as they are.
        debug_lines: abi::DebugLine, "debug line", 1 << 20, abi::STEP_DEBUG, FELT;
        /// Only when asked for.
        trace: abi::Trace, "trace", 1 << 24, abi::STEP_TRACE, FELT;
    }
    // The contract has them; this host does not take them yet.
    declared {}
}

impl Outputs {
    /// Shows all streams that the host takes to `visitor`, in the order of their numbers.
    pub fn show_all(&self, visitor: &mut impl Visit) {
        STREAMS.iter().for_each(|stream| self.show(stream.number, visitor));
    }

    /// All streams that the host takes as count and bytes, in the order of their numbers.
    pub fn all_bytes(&self) -> impl Iterator<Item = (&'static Stream, usize, &[u8])> {
        STREAMS.iter().filter_map(|stream| {
            let (count, bytes) = self.bytes(stream.number)?;
            Some((stream, count, bytes))
        })
    }
}

fn counted<T: Pod>(elements: &[T]) -> (usize, &[u8]) {
    (elements.len(), bytemuck::cast_slice(elements))
}

/// The rows in the order of their numbers. Does not compile unless each stream of the contract has exactly
/// one.
const fn sorted(rows: &[Stream]) -> [Stream; COUNT] {
    assert!(rows.len() == COUNT, "the table of streams does not have one row for each stream of reef_sim.h");
    let mut sorted = [rows[0]; COUNT];
    let mut number = 1;
    while number <= COUNT {
        let mut at = 0;
        while rows[at].number as usize != number {
            at += 1;
            assert!(at < COUNT, "the table of streams has one of them twice, and another one not at all");
        }
        sorted[number - 1] = rows[at];
        number += 1;
    }
    sorted
}
