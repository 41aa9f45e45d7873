//! `reef bench`: the measured figures of this machine, one bench a file. Figures with a bar fail the command
//! when they miss it; what is compared is always a ratio of two things measured in the same run.

pub mod allocations;
mod billboards;
mod cells;
pub mod churn;
mod contract;
mod demo;
mod fibre;
mod fig5;
mod fish;
mod flow;
mod jellyfish;
mod jumps;
pub mod measure;
mod meshes;
pub mod reload;
mod render;
pub mod report;
mod seaweed;
mod shoal;
mod swimmers;
mod table1;
mod table2;
mod waves;

use reef_command::Common;
use reef_report::{
    failure::{Failure, Outcome},
    say::say,
};
use reef_sea::scene::words::{did_you_mean, nearest};
use report::Report;
use serde_json::json;

/// Options of `reef bench`.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = listing())]
pub struct Args {
    /// Which bench; all without a name.
    pub name: Option<String>,
}

/// A bench: its name, what it is about, and its code.
struct Bench {
    name: &'static str,
    about: &'static str,
    run: fn(&Common) -> Result<Report, Failure>,
}

const BENCHES: &[Bench] = &[
    Bench {
        name: "billboards",
        about: "milliseconds a frame of 100 000 sprites in front of the eye, and around it",
        run: billboards::run,
    },
    Bench { name: "churn", about: "what ten thousand reloads of each plugin leave behind", run: churn::run },
    Bench {
        name: "contract",
        about: "what the contract costs: a guarded call, and a step beside the same model without it",
        run: contract::run,
    },
    Bench {
        name: "demo",
        about: "the window's loop without a window: pictures a second of the default sea, where time goes",
        run: demo::run,
    },
    Bench {
        name: "fibre",
        about: "node-steps of the anemones through a scene, beside a bare kernel's ceiling",
        run: fibre::run,
    },
    Bench {
        name: "fig5",
        about: "how far the paper's jellyfish gets in 20 s, by how often it contracts",
        run: fig5::run,
    },
    Bench {
        name: "fish",
        about: "spring-sub-steps of the fish's bodies, beside a bare kernel's ceiling, and ten thousand of \
                them",
        run: fish::run,
    },
    Bench {
        name: "flow",
        about: "the anemones of figure 13 among ten thousand singularities, beside one",
        run: flow::run,
    },
    Bench {
        name: "jellyfish",
        about: "an animal and its water by part, 64 of them, their surfaces, memory and jets",
        run: jellyfish::run,
    },
    Bench {
        name: "jumps",
        about: "what remembering a minute of the default sea costs its steps, and how long jumps within it \
                take",
        run: jumps::run,
    },
    Bench {
        name: "meshes",
        about: "what plants, bodies and bells add to a frame, with and without levels of detail",
        run: meshes::run,
    },
    Bench {
        name: "reload",
        about: "how soon a new build's first step comes after its file is renamed into place",
        run: reload::run,
    },
    Bench {
        name: "render",
        about: "milliseconds a frame of 1000, 2000 and 4000 tentacles over a lit bed",
        run: render::run,
    },
    Bench {
        name: "seaweed",
        about: "joint-steps of the seaweeds through a scene, beside a bare kernel's ceiling",
        run: seaweed::run,
    },
    Bench {
        name: "shoal",
        about: "fish-steps of a shoal of points, beside a bare kernel's ceiling, and a hundred thousand of \
                them",
        run: shoal::run,
    },
    Bench {
        name: "table1",
        about: "the particles of the paper's table 1 at five distances, with and without levels of detail, \
                and those of the default sea",
        run: table1::run,
    },
    Bench {
        name: "table2",
        about: "the seaweeds of the paper's table 2, with and without levels of detail, and its plants and \
                particles together",
        run: table2::run,
    },
    Bench {
        name: "waves",
        about: "a million particles on the orbits of thirty wave trains, beside a bare kernel's ceiling",
        run: waves::run,
    },
];

/// Measures and prints. A bar that was missed ends it with exit code 1, after all benches ran.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let chosen: Vec<&Bench> = match &args.name {
        None => BENCHES.iter().collect(),
        Some(name) => vec![find(name)?],
    };
    let mut reports = Vec::new();
    for bench in chosen {
        let report = (bench.run)(common)?;
        if !common.json {
            say(report.table(bench.name, bench.about));
        }
        reports.push((bench.name, report));
    }
    let missed: Vec<String> = reports
        .iter()
        .flat_map(|(name, report)| report.missed().map(move |figure| format!("{name}: {figure}")))
        .collect();
    if common.json {
        let benches: Vec<_> = reports.iter().map(|(name, report)| report.json(name)).collect();
        say(json!({ "benches": benches, "pass": missed.is_empty() }));
    }
    if missed.is_empty() {
        return Ok(());
    }
    Err(Failure::check(miette::miette!("missed: {}", missed.join("; "))))
}

fn find(name: &str) -> Result<&'static Bench, Failure> {
    BENCHES.iter().find(|bench| bench.name == name).ok_or_else(|| {
        let names = BENCHES.iter().map(|bench| bench.name);
        let meant = nearest(name, names).map(|name| format!("; {}", did_you_mean(name))).unwrap_or_default();
        Failure::input(miette::miette!(help = listing(), "there is no bench {name:?}{meant}"))
    })
}

/// All benches with what they are about.
fn listing() -> String {
    let width = BENCHES.iter().map(|bench| bench.name.len()).max().unwrap_or(0);
    let line = |bench: &Bench| format!("  {:width$}  {}", bench.name, bench.about);
    format!("Benches:\n{}", BENCHES.iter().map(line).collect::<Vec<_>>().join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_bench_is_refused_with_the_names_of_all() {
        let args = Args { name: Some("fiber".into()) };
        let failure = run(&Common::default(), &args).expect_err("no such bench");
        assert_eq!(failure.code, 2);
        assert!(failure.to_string().contains("did you mean `fibre`?"), "{failure}");
        let help = failure.report.help().map(|help| help.to_string()).unwrap_or_default();
        for bench in BENCHES {
            assert!(help.contains(bench.name) && help.contains(bench.about), "{help}");
        }
    }
}
