//! No shader branches on uniforms alone: lavapipe would compile it anew for each value, which is every frame.
//!
//! A condition is followed back through arithmetic, through variables that are written once, and through
//! arguments and results of functions.

use std::collections::HashMap;

use super::{embedded, reflect::words};

/// What a value hangs on; of several, the greatest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Hangs {
    /// Constants, of specialisation, too: fixed when a pipeline is made.
    Constant,
    /// Uniforms or push constants, and nothing else that changes.
    Uniform,
    /// A vertex, a pixel, an invocation; or a loop.
    Varying,
}

use Hangs::{Constant, Uniform, Varying};

// Instructions and storage classes by their numbers in the SPIR-V specification.
const CONSTANTS: [std::ops::RangeInclusive<u32>; 2] = [41..=46, 48..=52];
const EXT_INST: u32 = 12;
const FUNCTION: u32 = 54;
const FUNCTION_PARAMETER: u32 = 55;
const FUNCTION_CALL: u32 = 57;
const VARIABLE: u32 = 59;
const LOAD: u32 = 61;
const STORE: u32 = 62;
const ACCESS_CHAIN: u32 = 65;
const VECTOR_SHUFFLE: u32 = 79;
const COMPOSITE_CONSTRUCT: u32 = 80;
const COMPOSITE_EXTRACT: u32 = 81;
/// Conversions, arithmetic, logic, comparisons: their operands are values and nothing else.
const ARITHMETIC: std::ops::RangeInclusive<u32> = 109..=205;
const COMPARISONS: std::ops::RangeInclusive<u32> = 170..=191;
const BRANCH_CONDITIONAL: u32 = 250;
const RETURN_VALUE: u32 = 254;
const UNIFORM: u32 = 2;
const IN_FUNCTION: u32 = 7;
const PUSH_CONSTANT: u32 = 9;

fn is_constant(code: u32) -> bool {
    CONSTANTS.iter().any(|range| range.contains(&code))
}

#[derive(Default)]
struct Shader {
    /// Result → instruction and its words after the first.
    made: HashMap<u32, (u32, Vec<u32>)>,
    /// Pointer → what is written through it.
    written: HashMap<u32, Vec<u32>>,
    /// Parameter → its function and place.
    parameters: HashMap<u32, (u32, usize)>,
    /// Function → the arguments of its calls, and what it returns.
    calls: HashMap<u32, Vec<Vec<u32>>>,
    returned: HashMap<u32, Vec<u32>>,
    conditions: Vec<u32>,
    known: HashMap<u32, Hangs>,
}

impl Shader {
    fn read(words: &[u32]) -> Self {
        let mut shader = Self::default();
        let (mut at, mut function, mut parameters) = (5, 0, 0);
        while at < words.len() {
            let (count, code) = ((words[at] >> 16) as usize, words[at] & 0xffff);
            let rest = &words[at + 1..at + count];
            at += count;
            match code {
                FUNCTION => (function, parameters) = (rest[1], 0),
                FUNCTION_PARAMETER => {
                    shader.parameters.insert(rest[1], (function, parameters));
                    parameters += 1;
                }
                FUNCTION_CALL => shader.calls.entry(rest[2]).or_default().push(rest[3..].to_vec()),
                STORE => shader.written.entry(rest[0]).or_default().push(rest[1]),
                RETURN_VALUE => shader.returned.entry(function).or_default().push(rest[0]),
                BRANCH_CONDITIONAL => shader.conditions.push(rest[0]),
                _ => {}
            }
            let values = [VARIABLE, LOAD, ACCESS_CHAIN, EXT_INST, FUNCTION_CALL];
            let composites = [VECTOR_SHUFFLE, COMPOSITE_CONSTRUCT, COMPOSITE_EXTRACT];
            let computed = composites.contains(&code) || ARITHMETIC.contains(&code);
            if is_constant(code) || values.contains(&code) || computed {
                shader.made.insert(rest[1], (code, rest.to_vec()));
            }
        }
        shader
    }

    fn value(&mut self, id: u32) -> Hangs {
        if let Some(known) = self.known.get(&id) {
            return *known;
        }
        // What hangs on itself is a loop.
        self.known.insert(id, Varying);
        let found = self.follow(id);
        self.known.insert(id, found);
        found
    }

    fn follow(&mut self, id: u32) -> Hangs {
        let Some((code, rest)) = self.made.get(&id).cloned() else { return Varying };
        let of = match code {
            LOAD => return self.behind(rest[2]),
            FUNCTION_CALL => self.returned.get(&rest[2]).cloned().unwrap_or_default(),
            EXT_INST => rest[4..].to_vec(),
            VECTOR_SHUFFLE => rest[2..4].to_vec(),
            COMPOSITE_EXTRACT => rest[2..3].to_vec(),
            COMPOSITE_CONSTRUCT => rest[2..].to_vec(),
            _ if ARITHMETIC.contains(&code) => rest[2..].to_vec(),
            _ if is_constant(code) => return Constant,
            _ => return Varying,
        };
        of.into_iter().map(|id| self.value(id)).max().unwrap_or(Varying)
    }

    /// What lies behind a pointer.
    fn behind(&mut self, pointer: u32) -> Hangs {
        if let Some((function, place)) = self.parameters.get(&pointer).copied() {
            if self.written.contains_key(&pointer) {
                return Varying;
            }
            // Functions are inlined: one call with a uniform is enough.
            let arguments: Vec<u32> =
                self.calls.get(&function).into_iter().flatten().map(|call| call[place]).collect();
            let each: Vec<Hangs> = arguments.into_iter().map(|argument| self.behind(argument)).collect();
            let worst = [Uniform, Constant].into_iter().find(|hangs| each.contains(hangs));
            return worst.unwrap_or(Varying);
        }
        let Some((code, rest)) = self.made.get(&pointer).cloned() else { return Varying };
        match code {
            ACCESS_CHAIN => {
                let varying = rest[3..].iter().any(|index| self.value(*index) == Varying);
                if varying { Varying } else { self.behind(rest[2]) }
            }
            VARIABLE if [UNIFORM, PUSH_CONSTANT].contains(&rest[2]) => Uniform,
            VARIABLE if rest[2] == IN_FUNCTION => {
                let mut parts =
                    self.made.iter().filter(|(_, (code, rest))| *code == ACCESS_CHAIN && rest[2] == pointer);
                let in_parts = parts.any(|(part, _)| self.written.contains_key(part));
                match self.written.get(&pointer).map(Vec::as_slice) {
                    Some(&[once]) if !in_parts => self.value(once),
                    _ => Varying,
                }
            }
            _ => Varying,
        }
    }

    /// Whether a loop's counter is compared with a uniform.
    fn ends_a_loop(&mut self, condition: u32) -> bool {
        let Some((code, rest)) = self.made.get(&condition).cloned() else { return false };
        let counter = |shader: &Self, id: u32| {
            let Some((LOAD, load)) = shader.made.get(&id) else { return false };
            let variable = shader.made.get(&load[2]).is_some_and(|(code, _)| *code == VARIABLE);
            variable && shader.written.get(&load[2]).is_some_and(|written| written.len() == 2)
        };
        COMPARISONS.contains(&code)
            && [(2, 3), (3, 2)].into_iter().any(|(count, limit)| {
                rest.len() == 4 && counter(self, rest[count]) && self.value(rest[limit]) == Uniform
            })
    }

    /// The branches that hang on uniforms alone.
    fn bad(&mut self) -> Vec<u32> {
        let conditions = self.conditions.clone();
        conditions.into_iter().filter(|id| self.value(*id) == Uniform || self.ends_a_loop(*id)).collect()
    }
}

#[test]
fn no_shader_branches_on_uniforms_alone() {
    let mut branches = 0;
    for (name, bytes) in embedded::SHADERS {
        let mut shader = Shader::read(&words(bytes).unwrap());
        branches += shader.conditions.len();
        assert_eq!(
            shader.bad(),
            [0; 0],
            "{name}: these conditions hang on uniforms alone (see HIGH in view.glsl)"
        );
    }
    assert!(branches > 100, "{branches} were looked at");
}

#[test]
fn a_branch_on_a_uniform_is_found() {
    // mix() chooses by a comparison of a uniform here: the same as a branch's condition.
    let (_, bytes) = embedded::SHADERS.iter().find(|(name, _)| *name == "speck.vert").unwrap();
    let mut shader = Shader::read(&words(bytes).unwrap());
    let comparisons: Vec<u32> =
        shader.made.iter().filter(|(_, (code, _))| COMPARISONS.contains(code)).map(|(id, _)| *id).collect();
    let planted = comparisons.into_iter().find(|id| shader.value(*id) == Uniform).expect("in_diagram()");
    shader.conditions.push(planted);
    assert_eq!(shader.bad(), [planted]);
}
