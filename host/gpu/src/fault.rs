//! Faults that are planted on purpose, so that the checks which should find them can be seen to.

/// Names the fault to plant; heeded only where validation is on.
pub const VARIABLE: &str = "REEF_PLANT_FAULT";

/// A planted fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Barriers of buffers are left out where a shader wrote before: synchronisation validation has to
    /// notice.
    Barrier,
    /// Images that are to be read stay in a layout of another kind: core validation has to notice.
    Layout,
    /// A buffer is never given back: the leak check has to notice.
    Leak,
}

impl Fault {
    /// All of them, with their names.
    pub const ALL: [(&'static str, Fault); 3] =
        [("barrier", Fault::Barrier), ("layout", Fault::Layout), ("leak", Fault::Leak)];

    /// The fault that the environment asks for.
    pub fn from_environment() -> Option<Fault> {
        let wanted = std::env::var(VARIABLE).ok()?;
        let found = Self::ALL.iter().find(|(name, _)| *name == wanted);
        if found.is_none() && !wanted.is_empty() {
            tracing::warn!("{VARIABLE}={wanted}: no such fault (barrier, layout, leak)");
        }
        found.map(|(_, fault)| *fault)
    }
}
