//! Whether an instance is called.

/// In what state an instance is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Health {
    /// It steps.
    Running,
    /// It said that it needs a reset or a loaded state: its last outputs stand still until then.
    Stopped(String),
    /// It, or its library, is at fault (a panic, an output that is no number, too much of it): its last
    /// outputs stand still. A reset or a loaded state gives it another chance, unless the library's code was
    /// stopped (a signal, a call that did not end): then no instance of the library is called again.
    Faulty(String),
}
