//! What a plugin does beyond bad numbers and bad pointers — it throws, ends the program, takes the guards
//! away, is at fault while it is loaded or unloaded, writes to what it was lent: the program lives, names it,
//! and keeps the result.

use std::fs;

use object::{Object, ObjectSection};
use reef_tests::{
    artifacts::{artifacts, workspace},
    hostile::{Met, folder, meet, meet_in, scene, sim, sim_with},
};

/// The sum over all streams and states of the five steps, as it is without a fault; None: there is no
/// compiler.
fn sound() -> Option<String> {
    let met = sim("nothing@nowhere")?;
    assert_eq!(met.code, Some(0), "{}", met.text);
    Some(hash(&met).expect("a hash"))
}

fn hash(met: &Met) -> Option<String> {
    met.text.lines().find_map(|line| line.strip_prefix("hash ")).map(str::to_owned)
}

/// The plugin is stopped in `call` for `reason`: what came before is kept, and the exit code says that
/// something failed.
fn is_contained(wish: &str, call: &str, reason: &str) {
    let Some(met) = sim(wish) else { return };
    let told = format!("plugin `fixture.hostile`: {call} was stopped: {reason}");
    assert!(met.text.contains(&told), "{wish}: {}", met.text);
    let expected = if call == "create" { 2 } else { 1 };
    assert_eq!(met.code, Some(expected), "{wish}: {}", met.text);
}

const ABORTED: &str = "SIGABRT: it aborted";

#[test]
fn exceptions_that_nobody_catches_end_at_the_guard() {
    for wish in ["throw@step", "throw_int@step", "throw@job"] {
        is_contained(wish, "step", ABORTED);
    }
    is_contained("throw@create", "create", ABORTED);
    is_contained("throw@save", "save_state", ABORTED);
}

#[test]
fn a_thread_of_the_hosts_that_a_plugin_ends_goes_on() {
    is_contained("pthread_exit@step", "step", "it called pthread_exit");
    is_contained("pthread_exit@job", "step", "it called pthread_exit");
    is_contained("pthread_exit@create", "create", "it called pthread_exit");
}

#[test]
fn signals_of_traps_and_of_calls_that_are_not_allowed_are_contained() {
    is_contained("trap@step", "step", "SIGTRAP");
    is_contained("sys@job", "step", "SIGSYS");
}

#[test]
fn a_plugin_that_ends_the_program_ends_its_call_alone() {
    for end in ["exit", "_exit", "quick_exit"] {
        is_contained(&format!("{end}@step"), "step", &format!("it called {end},"));
        is_contained(&format!("{end}@job"), "step", &format!("it called {end},"));
    }
    is_contained("exit@create", "create", "it called exit,");
}

#[test]
fn what_a_plugin_takes_from_the_guards_is_put_back_and_told() {
    let Some(sound) = sound() else { return };
    for (wish, told) in [
        ("handler@step", "step took the handler of SIGSEGV"),
        ("handler_fpe@create", "create took the handler of SIGFPE"),
        ("mask@step", "step blocked signals of faults"),
        ("mask@job", "step blocked signals of faults"),
        ("stack@create", "create took the stack of the signals' handlers"),
        ("handler@constructor", "load took the handler of SIGSEGV"),
        ("handler@destructor", "unload took the handler of SIGSEGV"),
        ("mask@destructor", "unload blocked signals of faults"),
        ("handler@thread_local", "unload took the handler of SIGSEGV"),
    ] {
        let Some(met) = sim(wish) else { return };
        assert!(
            met.text.contains(&format!("{told}; the host's own is back in place")),
            "{wish}: {}",
            met.text
        );
        assert_eq!(met.text.matches("back in place").count(), 1, "told once: {}", met.text);
        assert_eq!((met.code, hash(&met)), (Some(0), Some(sound.clone())), "{wish}");
    }
    // And the guards guard: a fault after that is contained.
    for wish in ["handler_then_fault@step", "mask_then_fault@step", "stack_then_fault@step"] {
        is_contained(wish, "step", "SIGSEGV: address 0x10");
    }
}

#[test]
fn code_at_the_end_is_guarded_watched_and_named_and_the_result_is_whole() {
    let Some(sound) = sound() else { return };
    let runaway = "it did not end 2000 ms after it began";
    for (wish, call, reason) in [
        ("fault@destructor", "unload", "SIGSEGV"),
        ("throw@destructor", "unload", ABORTED),
        ("exit@destructor", "unload", "it called exit"),
        ("loop@destructor", "unload", runaway),
        ("fault@atexit", "unload", "SIGSEGV"),
        ("sleep@atexit", "unload", runaway),
        ("fault@thread_local", "unload", "SIGSEGV"),
        ("throw@thread_local", "unload", ABORTED),
        ("_exit@thread_local", "unload", "it called _exit"),
        ("loop@thread_local", "unload", runaway),
        ("sleep@thread_local", "unload", runaway),
        ("fault@close", "close", "SIGSEGV"),
        ("sleep@close", "close", runaway),
        ("fault@destroy", "destroy", "SIGSEGV"),
        ("loop@destroy", "destroy", runaway),
    ] {
        let Some(met) = sim(wish) else { return };
        assert_eq!((met.code, hash(&met)), (Some(0), Some(sound.clone())), "{wish}: {}", met.text);
        let who = if call == "destroy" { "fixture.hostile" } else { "libhostile.so" };
        let told = format!("plugin `{who}`: {call} was stopped: {reason}");
        assert_eq!(met.text.matches(&told).count(), 1, "{wish}: {}", met.text);
        assert_eq!(met.text.contains("and stays in memory"), call == "unload", "{wish}: {}", met.text);
    }
}

#[test]
fn a_thread_that_does_not_end_among_many_that_did_is_stopped_and_named() {
    let Some(sound) = sound() else { return };
    for wish in ["loop@worker_local", "sleep@worker_local"] {
        let Some(met) = sim_with(wish, &["--workers", "8"]) else { return };
        assert_eq!((met.code, hash(&met)), (Some(0), Some(sound.clone())), "{wish}: {}", met.text);
        let told = "plugin `libhostile.so`: unload was stopped: it did not end 2000 ms after it began";
        assert_eq!(met.text.matches(told).count(), 1, "{wish}: {}", met.text);
    }
}

#[test]
fn constructors_that_are_at_fault_refuse_the_library_and_hold_nothing_up() {
    // From here on the build is known, so that it is this program that loads it.
    if sound().is_none() {
        return;
    }
    for (wish, reason) in [
        ("abort@constructor", ABORTED),
        ("fault@constructor", "SIGSEGV"),
        ("throw@constructor", ABORTED),
        ("exit@constructor", "it called exit"),
        ("loop@constructor", "it did not end 2000 ms after it began"),
        ("sleep@constructor", "it did not end 2000 ms after it began"),
    ] {
        let Some(met) = meet(wish, &["plugin", "list"]) else { return };
        assert_eq!(met.code, Some(2), "{wish}: {}", met.text);
        let told = format!("load was stopped: {reason}");
        assert!(met.text.contains("libhostile.so") && met.text.contains(&told), "{wish}: {}", met.text);
        // The others are there.
        assert!(met.text.contains("reef.anemone"), "{wish}: {}", met.text);
    }
}

#[test]
fn the_process_that_tries_builds_has_the_patience_of_the_command_line() {
    let Some(folder) = folder() else { return };
    // Nobody knows the build there.
    let cache = tempfile::tempdir().expect("a folder");
    let list = |arguments: &[&str]| meet_in(folder, cache.path(), "busy@constructor", arguments);
    let met = list(&["plugin", "list"]);
    assert_eq!(met.code, Some(2), "{}", met.text);
    assert!(met.text.contains("it did not end 2000 ms after it began"), "{}", met.text);
    assert!(met.text.contains("--patience"), "{}", met.text);
    let met = list(&["plugin", "list"]);
    assert_eq!(met.code, Some(2), "{}", met.text);
    assert!(met.text.contains("that was seen before"), "{}", met.text);
    let met = list(&["sim", &scene(), "--steps", "1", "--patience", "10"]);
    assert_eq!(met.code, Some(0), "{}", met.text);
}

#[test]
fn a_known_plugin_that_cannot_be_loaded_is_told_with_its_reason() {
    if sound().is_none() {
        return;
    }
    let Some(met) = sim("fault@constructor") else { return };
    assert_eq!(met.code, Some(2), "{}", met.text);
    let told = "modules.hostile.use: the plugin \"fixture.hostile\" cannot be used: ";
    assert!(met.text.contains(told) && met.text.contains("load was stopped: SIGSEGV"), "{}", met.text);
    assert!(!met.text.contains("there is no plugin"), "{}", met.text);
}

#[test]
fn what_a_constructor_was_handed_is_there_as_long_as_the_library() {
    let Some(sound) = sound() else { return };
    let Some(met) = sim("kept@arguments") else { return };
    assert_eq!((met.code, hash(&met)), (Some(0), Some(sound)), "{}", met.text);
}

#[test]
fn what_a_plugin_writes_to_its_input_reaches_nobody_else() {
    let Some(sound) = sound() else { return };
    for wish in ["flow@input", "camera@input", "water@input"] {
        let Some(met) = sim(wish) else { return };
        assert_eq!((met.code, hash(&met)), (Some(0), Some(sound.clone())), "{wish}: {}", met.text);
    }
    is_contained("heights@input", "step", "SIGSEGV: address");
}

#[test]
fn tables_and_contexts_that_a_plugin_spoils_are_its_own_fault() {
    for wish in ["zero@table", "ctx@table", "wild@table", "null@table", "host@table", "host_ctx@table"] {
        let Some(met) = sim(wish) else { return };
        assert_eq!(met.code, Some(0), "{wish}: {}", met.text);
    }
    for service in ["commit", "reserve", "log", "scratch"] {
        let told = format!("it called {service} with a context that the host did not give it");
        is_contained(&format!("{service}@table"), "step", &told);
    }
    is_contained("context@writer", "save_state", "it called write with a context");
}

#[test]
fn what_is_written_behind_a_room_is_seen_and_named() {
    for (wish, told) in [
        ("one@room", "stream object: more was written than the 1 elements that were reserved"),
        ("scratch@room", "scratch: more was written than the 100 bytes that were lent"),
    ] {
        let Some(met) = sim(wish) else { return };
        assert!(met.text.contains(told) && met.text.contains("hostile"), "{wish}: {}", met.text);
        assert_eq!(met.code, Some(1), "{wish}: {}", met.text);
    }
}

#[test]
fn a_program_whose_memory_is_spoilt_names_the_last_plugin_as_it_ends() {
    // Too far for the fence: what the C library keeps there is gone.
    let Some(met) = sim("before@room") else { return };
    let named =
        met.text.contains("the last plugin that ran is `fixture.hostile`, which may have written over");
    assert!(met.code.is_some() || named, "{}", met.text);
    assert!(met.text.contains("fixture.hostile") || met.code == Some(0), "{}", met.text);
}

#[test]
fn a_program_that_a_plugins_own_thread_ends_names_the_one_that_was_called() {
    if sound().is_none() {
        return;
    }
    for (wish, who) in [
        ("fault_apart@constructor", "libhostile.so"),
        ("fault_apart@create", "fixture.hostile"),
        ("fault_apart@step", "fixture.hostile"),
        ("fault_apart@save", "fixture.hostile"),
        ("fault_apart@destructor", "libhostile.so"),
    ] {
        let Some(met) = sim(wish) else { return };
        let told = format!("the last plugin that ran is `{who}`");
        assert!(met.code.is_none() && met.text.contains(&told), "{wish}: {}", met.text);
    }
}

#[test]
fn a_build_that_nobody_knows_is_at_fault_in_a_process_of_its_own() {
    let Some(folder) = folder() else { return };
    for (wish, reason) in [
        ("fault@constructor", "load was stopped: SIGSEGV"),
        ("end@constructor", "the process that loaded it first ended itself with exit code 0"),
        ("kill@open", "the process that loaded it first was ended by signal 9"),
        ("loop@open", "open was stopped: it did not end 2000 ms after it began"),
    ] {
        let cache = tempfile::tempdir().unwrap();
        let met = meet_in(folder, cache.path(), wish, &["plugin", "list"]);
        assert_eq!(met.code, Some(2), "{wish}: {}", met.text);
        assert!(met.text.contains(reason) && met.text.contains("reef.anemone"), "{wish}: {}", met.text);
    }
}

#[test]
fn a_file_that_crashes_the_systems_loader_is_refused_and_no_other() {
    let mut bytes = fs::read(artifacts().plugin("reef_example_rust")).unwrap();
    let (start, _) = {
        let file = object::File::parse(&*bytes).unwrap();
        file.section_by_name(".rela.dyn").unwrap().file_range().unwrap()
    };
    // The first relocation writes to where nothing is.
    bytes[start as usize..start as usize + 8].copy_from_slice(&0x1234_5678_0000_u64.to_ne_bytes());
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("libdamaged.so"), bytes).unwrap();
    let met = meet_in(folder.path(), folder.path(), "nothing@nowhere", &["plugin", "list"]);
    assert_eq!(met.code, Some(2), "{}", met.text);
    let told = "the process that loaded it first was ended by signal 11: the file is damaged";
    assert!(met.text.contains(told) || met.text.contains("load was stopped: SIGSEGV"), "{}", met.text);
    assert!(met.text.contains("libdamaged.so") && met.text.contains("reef.anemone"), "{}", met.text);
    // Nobody tries it once more.
    let again = meet_in(folder.path(), folder.path(), "nothing@nowhere", &["plugin", "list"]);
    assert_eq!(again.code, Some(2), "{}", again.text);
    assert!(again.text.contains("that was seen before: to try it again, remove"), "{}", again.text);
}

#[test]
fn the_last_words_of_a_run_name_what_it_has_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (journal, record) = (path("journal"), path("r.csv"));
    let arguments = ["--journal", &*journal, "--record", &*record];
    let Some(met) = sim_with("fault_apart@step", &arguments) else { return };
    let told =
        format!("The journal {journal} holds all inputs. What was recorded, but for its last lines, is in");
    assert!(met.code.is_none() && met.text.contains(&told), "{}", met.text);
    let kept = fs::read_to_string(journal).unwrap();
    assert!(kept.starts_with("{\"reef_journal\":1,") && kept.contains("{\"end\":"), "{kept}");
}

#[test]
fn a_plugin_that_no_scene_asks_for_is_not_loaded() {
    if sound().is_none() {
        return;
    }
    let scene = workspace().join("assets/scenes/anemone-fig10-exponent.toml");
    let scene = scene.to_string_lossy();
    for arguments in [&["scene", "check", &scene][..], &["sim", &scene, "--steps", "2"]] {
        let Some(met) = meet("fault@constructor", arguments) else { return };
        assert_eq!(met.code, Some(0), "{}", met.text);
        assert!(!met.text.contains("hostile"), "{}", met.text);
    }
}
