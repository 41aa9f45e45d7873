//! What one instance emitted in one step, validated and owned by the host.

use std::sync::Arc;

use reef_abi as abi;

/// The committed outputs of one instance in one step. Indices in the elements (object, material, first_node …) refer to
/// the vectors beside them and have been checked to lie inside them.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    /// Things in the sea: what all other elements belong to.
    pub objects: Vec<abi::Object>,
    /// Retained from the last step that committed it.
    pub materials: Arc<Vec<abi::Material>>,
    /// Node chains.
    pub fibres: Vec<abi::Fibre>,
    /// Nodes of all chains, relative to their object's origin.
    pub fibre_nodes: Vec<abi::FibreNode>,
    /// What this instance does to the water.
    pub flows: Vec<abi::Flow>,
    /// What others may perceive.
    pub actors: Vec<abi::Actor>,
    /// Drawn as they are.
    pub debug_lines: Vec<abi::DebugLine>,
    /// Only when asked for.
    pub trace: Vec<abi::Trace>,
}
