//! What surrounds a bed in a step, and what a person may change while the sea runs.

use reef_flow::Level;
use reef_sdk::{
    Heightfield, Workers,
    abi::{self, Camera, Flow, Obstacle},
};

use crate::wide::{Force, StepConstants};

/// What surrounds the plants in one step.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// All primitives, in the host's order.
    pub flow: &'a [Flow],
    /// All wave trains, greatest first.
    pub waves: &'a [abi::Wave],
    /// Of the water [m].
    pub depth: f64,
    /// Who looks: how many trains matter follows from it. None: all do.
    pub camera: Option<&'a Camera>,
    /// Rocks.
    pub obstacles: &'a [Obstacle],
    /// The sea bed.
    pub ground: Option<Heightfield<'a>>,
    /// ρ [kg/m³].
    pub density: f32,
    /// μ [Pa s].
    pub viscosity: f32,
    /// Length of the step [s]; 0: only emit.
    pub dt: f64,
    /// Instruction set.
    pub level: Level,
    /// Who shares the work.
    pub workers: Workers<'a>,
}

impl Default for Surroundings<'_> {
    /// Still sea water without a bed.
    fn default() -> Self {
        let StepConstants { density, viscosity, .. } = StepConstants::default();
        Self {
            flow: &[],
            waves: &[],
            depth: 10.0,
            camera: None,
            obstacles: &[],
            ground: None,
            density,
            viscosity,
            dt: 1.0 / 60.0,
            level: Level::best(),
            workers: Workers::inline(),
        }
    }
}

/// What a person may change while the sea runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Factor on every K.
    pub stiffness: f64,
    /// Added to every n.
    pub exponent: f64,
    /// Factor on every τ.
    pub damping: f64,
    /// Factor on every drag force.
    pub drag: f32,
    /// Factor on the flow's velocity.
    pub current: f32,
    /// Factor on the waves' orbital velocity; with 0 there are none.
    pub waves: f32,
    /// Leave out wave trains that nobody sees the work of.
    pub trains: bool,
    /// Stiffness of contacts over that of the touching node.
    pub contact: f32,
    /// The law of fibres whose drag is an area.
    pub force: Force,
    /// Loads without deformation.
    pub rigid: bool,
}

impl Default for Settings {
    fn default() -> Self {
        let constants = StepConstants::default();
        Self {
            stiffness: 1.0,
            exponent: 0.0,
            damping: 1.0,
            drag: constants.drag,
            current: constants.current,
            waves: 1.0,
            trains: true,
            contact: constants.contact,
            force: constants.force,
            rigid: constants.rigid,
        }
    }
}
