//! One step's result, whole and immutable: what the renderer, the recorder and the next step read.

use std::sync::{Arc, LazyLock};

use glam::{DVec3, Quat, Vec3};

use crate::{Outputs, identity::ModuleTag};

/// Where a picture is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Eye [m].
    pub position: DVec3,
    /// Turns camera space (looks along −z, y up) into world space.
    pub rotation: Quat,
    /// Vertical field of view [rad].
    pub fov_y: f32,
}

/// Middle [m] and radius [m] of an object's bounding sphere.
pub fn bounding_sphere(object: &reef_abi::Object) -> (DVec3, f64) {
    let local = Vec3::from(object.bounds_center).as_dvec3();
    (DVec3::from(object.origin) + local, f64::from(object.bounds_radius))
}

/// The sea after one step.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Number of the step; 0 is the state before the first.
    pub step: u64,
    /// Time at the end of the step [s].
    pub time: f64,
    /// The scene's camera at that time.
    pub camera: CameraPose,
    /// What each instance emitted, in the scene's order of modules.
    pub outputs: Vec<Arc<Outputs>>,
    /// The tag of each instance's module: what others know its objects by.
    pub tags: Arc<[ModuleTag]>,
    /// The scene's flow primitives at that time, then what instances emitted, in the fixed order in which the
    /// next step sees them.
    pub flow: Arc<Vec<reef_abi::Flow>>,
}

impl Frame {
    /// What the module at a place of the scene emitted; nothing, where it was not there yet.
    pub fn of_module(&self, module: usize) -> &Outputs {
        static NOTHING: LazyLock<Outputs> = LazyLock::new(Outputs::default);
        self.outputs.get(module).map_or_else(|| &*NOTHING, AsRef::as_ref)
    }
}
