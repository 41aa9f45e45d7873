//! How a guarded call ended that did not return.

use std::time::Duration;

/// What ended a call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// A signal, in words: `SIGSEGV: address 0x10 is not mapped`.
    Signal(String),
    /// It asked for the end of the program or of its thread, by this function of the C library.
    Ended(&'static str),
    /// It called this service with a context that is none of the host's.
    Foreign(&'static str),
    /// It did not end in time.
    Runaway {
        /// The limit after which it was asked to stop.
        limit: Duration,
        /// The option that lengthens it, where there is one.
        option: Option<&'static str>,
    },
}

/// What guards need, and a plugin can take.
#[cfg(target_os = "linux")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The signals' handlers.
    Handlers,
    /// What each thread has: its mask, and the stack of handlers.
    Thread,
}

/// How a call ended that did not return.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub(crate) cause: Cause,
    /// Where the code was: `libsea.so+0x1c20`. None: unknown.
    pub(crate) place: Option<String>,
    /// The job of `parallel_for` that it was in.
    pub(crate) job: Option<u32>,
}

impl Fault {
    /// As people read it; the plugin and the call are its subject.
    pub(crate) fn describe(&self, plugin: &str, call: &str) -> String {
        let cause = match &self.cause {
            Cause::Signal(text) => text.clone(),
            Cause::Foreign(service) => {
                format!("it called {service} with a context that the host did not give it")
            }
            Cause::Ended(function) => {
                format!("it called {function}, and a plugin ends nothing but its calls")
            }
            Cause::Runaway { limit, option } => {
                let longer = option.map(|option| format!(" ({option} waits longer)")).unwrap_or_default();
                let limit = limit.as_millis();
                format!("it did not end {limit} ms after it began, nor when it was asked to{longer}")
            }
        };
        let job = self.job.map(|job| format!(", in job {job}")).unwrap_or_default();
        let place = self.place.as_ref().map(|place| format!(", at {place}")).unwrap_or_default();
        format!(
            "plugin `{plugin}`: {call} was stopped: {cause}{place}{job}; its library is not called any more"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_names_plugin_call_signal_address_job_and_place() {
        let fault = Fault {
            cause: Cause::Signal("SIGSEGV: address 0x10 is not mapped".into()),
            place: Some("libsea.so+0x1c20".into()),
            job: Some(7),
        };
        assert_eq!(
            fault.describe("a.b", "step"),
            "plugin `a.b`: step was stopped: SIGSEGV: address 0x10 is not mapped, at libsea.so+0x1c20, in job 7; its \
             library is not called any more"
        );
        let limit = Duration::from_millis(250);
        for (option, end) in [(None, "asked to;"), (Some("--x S"), "asked to (--x S waits longer);")] {
            let runaway = Fault { cause: Cause::Runaway { limit, option }, place: None, job: None };
            let told = runaway.describe("a.b", "step");
            assert!(
                told.contains("did not end 250 ms after it began, nor when it was ") && told.contains(end)
            );
        }
    }
}
