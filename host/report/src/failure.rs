//! Why a command ended without doing what it was asked for, and the exit code that says so.

use std::fmt;

/// A command's failure: one report for people, one exit code for programs.
#[derive(Debug)]
pub struct Failure {
    /// 1: the check failed; 2: usage or bad input; 3: the machine lacks something.
    pub code: u8,
    /// What is printed: what, where, what is allowed.
    pub report: miette::Report,
}

/// What every command returns.
pub type Outcome = Result<(), Failure>;

impl Failure {
    /// A check said no: a golden picture differs, a validation message came (exit code 1).
    pub fn check(report: impl Into<miette::Report>) -> Self {
        Self { code: 1, report: report.into() }
    }

    /// Bad input: a scene, plugin, asset, state, flag or path (exit code 2).
    pub fn input(report: impl Into<miette::Report>) -> Self {
        Self { code: 2, report: report.into() }
    }

    /// The machine lacks something: a driver, a layer, a program (exit code 3). The report names the way out.
    pub fn machine(report: impl Into<miette::Report>) -> Self {
        Self { code: 3, report: report.into() }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.report)
    }
}
