//! What the host lends, and what a plugin must not get elsewhere.

use reef_plugin::bare::{calls::misplaced, imports::Kind};
use reef_streams::retained::Refused;

use super::{
    sea::Sea,
    step::FULL,
    subject::{Subject, WORKERS, difference, everything, run, step},
    table::{
        Check, Of,
        Rule::{Guide, Header},
    },
    verdict::{Not, Outcome, broken, must},
};

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "services-scratch",
        about: "Scratch memory of one step is not relied on in the next.",
        rule: Header("Memory until the end of this step"),
        needs: FULL,
        of: Of::Plugin,
        run: scratch,
    },
    Check {
        name: "services-float",
        about: "Steps leave rounding and the smallest numbers as they were.",
        rule: Header("All give the same bytes."),
        needs: FULL,
        of: Of::Plugin,
        run: float,
    },
    Check {
        name: "services-threads",
        about: "No thread or process is started.",
        rule: Header("Plugins never start threads."),
        needs: FULL,
        of: Of::Plugin,
        run: threads,
    },
    Check {
        name: "services-jobs",
        about: "No job reserves or commits: that is done before and after the loop.",
        rule: Header("reserve before parallel_for"),
        needs: FULL,
        of: Of::Plugin,
        run: jobs,
    },
    Check {
        name: "services-libm",
        about: "No step calls functions of the C library that differ from system to system.",
        rule: Guide("No `sin`, `cos`, `exp` or `pow` of the C library or of Rust's `std`"),
        needs: FULL,
        of: Of::Plugin,
        run: inexact,
    },
    Check {
        name: "services-texture",
        about: "Textures are asked for as the host can make them: their format and size, on the control thread, outside of jobs.",
        rule: Header("/* 1..1024 */"),
        needs: FULL,
        of: Of::Plugin,
        run: fit,
    },
    Check {
        name: "services-textures",
        about: "There are never more textures than the host keeps.",
        rule: Guide("At most 64 textures of 1024 texels a side for an instance"),
        needs: FULL,
        of: Of::Plugin,
        run: few,
    },
    Check {
        name: "services-texture-there",
        about: "Only textures that are there are destroyed.",
        rule: Header("stays until it was destroyed as often"),
        needs: FULL,
        of: Of::Plugin,
        run: there,
    },
    Check {
        name: "services-mesh",
        about: "Meshes are sound: their sizes, indices, levels, joints and weights.",
        rule: Header("those of a vertex sum to 1 within 0.001"),
        needs: FULL,
        of: Of::Plugin,
        run: mesh_fit,
    },
    Check {
        name: "services-meshes",
        about: "There are never more meshes than the host keeps.",
        rule: Guide("At most 256 meshes of 2^22 vertices and 2^24 indices in all for an instance"),
        needs: FULL,
        of: Of::Plugin,
        run: mesh_few,
    },
    Check {
        name: "services-mesh-there",
        about: "Only meshes that are there are destroyed.",
        rule: Header("is the same, with the same id, and stays until it was destroyed as often."),
        needs: FULL,
        of: Of::Plugin,
        run: mesh_there,
    },
];

fn scratch(subject: &Subject) -> Outcome {
    let (plugin, mut plain) = subject.fresh()?;
    let mut soiled = subject.create(&plugin)?;
    let sea = Sea::full();
    for number in 0..20 {
        step(&mut plain, &sea.input(number), &[])?;
        step(&mut soiled, &sea.input(number), &[])?;
        if let Some(difference) = difference(&everything(&mut plain)?, &everything(&mut soiled)?) {
            broken!(
                "with other content in the scratch memory of former steps, step {number} is another: {difference}"
            );
        }
        soiled.soil_scratch();
    }
    Ok(None)
}

fn float(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    for number in 0..20 {
        let [before, after] = instance.step_float(&Sea::full().input(number));
        must!(
            before == after,
            "step {number} changed the floating-point control word from {before:#x} to {after:#x}: -ffast-math does that"
        );
    }
    Ok(None)
}

fn threads(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let text = subject.create_text(&plugin)?;
    let imports = plugin.library().watch_imports().map_err(Not::There)?;
    let (count, name) = imports.count(Kind::Thread, || {
        // Whether it can be made and steps is for other checks.
        if let Ok(mut instance) = plugin.create(&text) {
            let _ = run(&mut instance, &Sea::full(), 0..60);
        }
    });
    must!(count == 0, "it called {name} {count} times");
    Ok(None)
}

fn jobs(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    run(&mut instance, &Sea::full(), 0..60)?;
    let count = misplaced();
    must!(count == 0, "in 60 steps its jobs called reserve or commit {count} times");
    Ok(None)
}

fn inexact(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = subject.fresh()?;
    let imports = plugin.library().watch_imports().map_err(Not::There)?;
    let (count, name) = imports.count(Kind::Inexact, || {
        // Whether it steps is for other checks.
        let _ = run(&mut instance, &Sea::full(), 0..60);
    });
    must!(count == 0, "in 60 steps it called such functions {count} times, {name} the last");
    Ok(None)
}

/// What the host refused of textures and of meshes, in the life of an instance that was reset and took up a
/// state on the way.
fn refused(subject: &Subject) -> Result<[Refused; 2], Not> {
    let (_plugin, mut instance) = subject.fresh()?;
    let sea = Sea::full();
    run(&mut instance, &sea, 0..60)?;
    // Whether it can do these, and goes on then, is for other checks.
    if let Ok(state) = instance.save() {
        let _ = instance.load(&state);
        let _ = run(&mut instance, &sea, 60..100);
    }
    if instance.reset().is_ok() {
        let _ = run(&mut instance, &sea, 0..40);
    }
    // Nor is here what comes of its end.
    Ok(instance.destroy_and_tell().unwrap_or_default())
}

fn textures(subject: &Subject) -> Result<Refused, Not> {
    let [textures, _] = refused(subject)?;
    Ok(textures)
}

fn meshes(subject: &Subject) -> Result<Refused, Not> {
    let [_, meshes] = refused(subject)?;
    Ok(meshes)
}

fn never(service: &str, reason: Option<String>) -> Outcome {
    match reason {
        Some(reason) => broken!("{service} refused: {reason}"),
        None => Ok(None),
    }
}

fn fit(subject: &Subject) -> Outcome {
    never("texture_create", textures(subject)?.unfit)
}

fn few(subject: &Subject) -> Outcome {
    never("texture_create", textures(subject)?.too_many)
}

fn there(subject: &Subject) -> Outcome {
    never("texture_destroy", textures(subject)?.missing)
}

fn mesh_fit(subject: &Subject) -> Outcome {
    never("mesh_create", meshes(subject)?.unfit)
}

fn mesh_few(subject: &Subject) -> Outcome {
    never("mesh_create", meshes(subject)?.too_many)
}

fn mesh_there(subject: &Subject) -> Outcome {
    never("mesh_destroy", meshes(subject)?.missing)
}
