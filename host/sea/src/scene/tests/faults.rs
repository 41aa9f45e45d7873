//! Bad scenes, each with its one clear error.

use super::*;

#[test]
fn each_wrong_key_or_value_gives_one_error_with_its_place_and_what_is_allowed() {
    let place = Place::new(&[KELP]);
    let cases: &[(&str, &str, &str)] = &[
        // text, beginning of the error, a part of it
        (
            "[scene]\nsed = 1\n",
            "scene.toml:2:1: scene.sed: is not known; allowed here: name, description, seed",
            "",
        ),
        ("[scenes]\n", "scene.toml:1:2: scenes: is not known", "modules"),
        (
            "[scene]\nseed = 'x'\n",
            "scene.toml:2:8: scene.seed: is text, but must be a whole number at least 0",
            "",
        ),
        (
            "[scene]\nseed = -1\n",
            "scene.toml:2:8: scene.seed: is -1, but must be a whole number at least 0",
            "",
        ),
        ("[scene]\nseed = 1.0\n", "scene.toml:2:8: scene.seed: is a number, but must be a whole number", ""),
        (
            "[scene]\ndt = 0\n",
            "scene.toml:2:6: scene.dt: is 0, but must be a number from 0.00001 to 10 [s]",
            "",
        ),
        ("[scene]\ndt = 1/60\n", "scene.toml:2:", "this is not TOML"),
        ("[scene]\nseed = 1\nseed = 2\n", "scene.toml:3:1:", "this is not TOML: duplicate key"),
        ("[scene]\nbackground = 'red'\n", "scene.toml:2:14: scene.background: is \"red\"", "#F4F4F0"),
        ("[camera]\nfov = nan\n", "scene.toml:2:7: camera.fov: nan is not a finite number", ""),
        (
            "[camera]\nposition = [1, 2]\n",
            "scene.toml:2:12: camera.position: has 2 elements, but must have 3",
            "",
        ),
        (
            "[camera]\nposition = [1, 2, inf]\n",
            "scene.toml:2:19: camera.position[2]: inf is not a finite",
            "",
        ),
        (
            "[camera]\nposition = 'here'\n",
            "scene.toml:2:12: camera.position: is text, but must be a list of 3 numbers, or a table",
            "",
        ),
        ("[camera]\nnear = 5\nfar = 1\n", "scene.toml:3:7: camera.far: is 1, but must be above `near`", ""),
        ("[camera]\nposition = [1,1,1]\norbit = {}\n", "scene.toml:3:1: camera.orbit: takes the place", ""),
        (
            "[water]\noptics = 'IC'\n",
            "scene.toml:2:10: water.optics: is \"IC\", but must be one of \"reef\", \"IB\"",
            "1C",
        ),
        (
            "[[flow]]\nkind = 'vortex'\n",
            "scene.toml:2:8: flow[0].kind: is \"vortex\", but must be one of \"source\"",
            "whirlwind",
        ),
        ("[[flow]]\nstrength = 1\n", "scene.toml:1:1: flow[0]: the key `kind` is missing", ""),
        (
            "[[flow]]\nkind = 'source'\n",
            "scene.toml:1:1: flow[0]: the key `strength` of flow[0] is missing",
            "a number",
        ),
        ("[flow]\nkind = 'source'\n", "scene.toml:1:2: flow: is a table, but must be a list", ""),
        (
            "[[flow]]\nkind = 'directional'\ndirection = [0, 0, 0]\nspeed = 1\n",
            "scene.toml:3:13: flow[0].direction: must not be zero",
            "",
        ),
        (
            "[[flow]]\nkind = 'hole'\nstrength = { keys = [{ time = 1, value = 0 }, { time = 1, value = 2 }] }\n",
            "scene.toml:3:56: flow[0].strength.keys[1].time: must be after",
            "",
        ),
        (
            "[[flow]]\nkind = 'hole'\nstrength = { keys = [{ tine = 1, value = 0 }] }\n",
            "scene.toml:3:",
            "tine: is not known; allowed here: time, value",
        ),
        (
            "[[flow]]\nkind = 'hole'\nstrength = 1\nattach = { module = 'fish', object = 1 }\n",
            "scene.toml:4:21: flow[0].attach.module: there is no module \"fish\"",
            "",
        ),
        (
            "[terrain]\nsize = [1e5, 1e5]\ncell = 0.01\n",
            "scene.toml:1:2: terrain: `size` and `cell`",
            "the limit is 4000000",
        ),
        (
            "[terrain.rocks]\ncount = 20000\n",
            "scene.toml:2:9: terrain.rocks.count: is 20000, but must be a whole number",
            "from 0 to 10000",
        ),
        (
            "[waves]\n",
            "scene.toml:1:2: waves: the key `wind` of waves is missing",
            "a number from 0 to 60 [m/s]",
        ),
        (
            "[waves]\nwind = -1\n",
            "scene.toml:2:8: waves.wind: is -1, but must be a number from 0 to 60 [m/s]",
            "",
        ),
        (
            "[waves]\nwind = 5\ntrains = 0\n",
            "scene.toml:3:10: waves.trains: is 0, but must be a whole number from 1 to 256",
            "",
        ),
        (
            "[waves]\nwind = 5\ntrains = 100000\n",
            "scene.toml:3:10: waves.trains: is 100000, but must be a whole number from 1 to 256",
            "",
        ),
        (
            "[waves]\nwind = 5\ntrains = 256\n[[wave]]\namplitude = 0.1\nwavelength = 3\n",
            "scene.toml:3:10: waves.trains: makes 257 wave trains with the listed ones; the limit is 256",
            "",
        ),
        ("[waves]\nwind = 20\n", "scene.toml:2:8: waves.wind: raises waves of 8.5", "write at most 11.8"),
        (
            "[waves]\nwind = 5\n[water]\ndepth = 0\n",
            "scene.toml:4:9: water.depth: is 0, but must be a number above 0 and at most 11000 [m]",
            "",
        ),
        ("[modules.a]\n", "scene.toml:1:10: modules.a: the key `use` of modules.a is missing", "text"),
        (
            "[modules.a]\nuse = 'reef.wed'\n",
            "scene.toml:2:7: modules.a.use: there is no plugin \"reef.wed\"; known: reef.weed",
            "",
        ),
        (
            "[modules.a]\nuse = 'reef.broken'\n",
            "scene.toml:2:7: modules.a.use: the plugin \"reef.broken\" cannot be used: it is for another machine",
            "",
        ),
        (
            "[modules.a]\nuse = 'reef.weed'\nplant = []\n",
            "scene.toml:3:1: modules.a.plant: is not known; allowed here: plants, shape",
            "",
        ),
        (
            "[modules.a]\nuse = 'reef.weed'\nplants = [{ species = 'kelp', nodes = 900 }]\n",
            "scene.toml:3:39: modules.a.plants[0].nodes: is 900, but must be a whole number from 2 to 64",
            "",
        ),
        (
            "[modules.a]\nuse = 'reef.weed'\nshape = { kind = 'rond' }\n",
            "scene.toml:3:18: modules.a.shape.kind: is \"rond\", but must be one of \"round\", \"flat\"",
            "",
        ),
        (
            "[modules.a]\nuse = 'reef.weed'\nshape = { kind = 'round' }\n",
            "scene.toml:3:1: modules.a.shape: the key `radius` of modules.a.shape is missing",
            "",
        ),
        (
            "[modules.a]\nuse = 'reef.weed'\nparams = { swey = 1 }\n",
            "scene.toml:3:12: modules.a.params.swey: is not known; allowed here: sway, on, level",
            "",
        ),
        (
            "[modules.a]\nuse = 'reef.weed'\nparams = { sway = 3 }\n",
            "scene.toml:3:19: modules.a.params.sway: is 3, but must be a number from 0 to 2",
            "",
        ),
        ("[modules.'a b']\nuse = 'reef.weed'\n", "scene.toml:1:10: modules.a b: is no name for a module", ""),
    ];
    for (text, beginning, part) in cases {
        let (told, help) = place.error(text);
        assert!(told.starts_with(beginning), "\n   wanted {beginning}\n      got {told}\n      for {text}");
        let whole = format!("{told} {}", help.unwrap_or_default());
        assert!(whole.contains(part), "\n{whole}\n lacks {part}");
    }
}

#[test]
fn the_nearest_spelling_is_offered_and_nothing_where_none_is_near() {
    let place = Place::new(&[]);
    assert_eq!(place.error("[scene]\nsed = 1\n").1.as_deref(), Some("did you mean `seed`?"));
    assert_eq!(place.error("[water]\noptics = 'rief'\n").1.as_deref(), Some("did you mean `reef`?"));
    assert_eq!(place.error("[scene]\nxyzzyqq = 1\n").1, None);
    assert_eq!(place.error("[camera]\nfov = '55'\n").1.as_deref(), Some("write 55, without quotes"));
}

#[test]
fn several_faults_are_told_together() {
    let place = Place::new(&[]);
    let error = place.load("[scene]\nsed = 1\ndt = 'x'\n[camera]\nfov = 500\n").expect_err("three faults");
    assert_eq!(error.count(), 3);
}

#[test]
fn files_that_are_no_scene_are_refused_before_they_are_parsed() {
    let place = Place::new(&[]);
    assert_eq!(place.error("").0, "scene.toml: the scene file is empty");
    assert!(place.error(" \n\t").0.contains("the scene file is empty"));
    let (told, help) = place.error(b"[scene]\nname = \"\xff\xfe\"\n");
    assert!(told.contains("is not UTF-8 text: byte 16, line 2"), "{told}");
    assert_eq!(help.as_deref(), Some("save it as UTF-8"));
    let large = place.0.path().join("large.toml");
    fs::File::create(&large).and_then(|file| file.set_len(100 << 20)).expect("a sparse file of 100 MB");
    let told = load(&large, place.0.path(), &Fake).expect_err("too large").to_string();
    assert!(told.ends_with("the scene file has 100.0 MiB; the limit is 4 MiB"), "{told}");
    let told = load(place.0.path(), place.0.path(), &Fake).expect_err("a folder").to_string();
    assert!(told.ends_with("this is a folder, not a scene file"), "{told}");
    place.load("[scene]\n").expect("a good scene");
    let missing = load(&place.0.path().join("scena.toml"), place.0.path(), &Fake).expect_err("missing");
    assert!(missing.to_string().ends_with("there is no such scene file"), "{missing}");
    assert_eq!(missing.help_text(), Some("did you mean `scene.toml`?"));
}

#[test]
fn absurd_depth_and_length_do_not_break_the_reader() {
    let place = Place::new(&[]);
    let deep = format!("[modules.a]\nuse = 'reef.weed'\nplants = {}{}\n", "[".repeat(5000), "]".repeat(5000));
    assert!(place.load(deep).is_err());
    let many = "[[obstacle]]\nfrom = [0,0,0]\nto = [0,1,0]\nradius = 1\n".repeat(4097);
    let (told, _) = place.error(many);
    assert!(told.contains("obstacle: has 4097 elements; the limit is 4096"), "{told}");
    let (told, _) = place.error("[scene]\nseed = 99999999999999999999\n");
    assert!(told.contains("scene.seed: 99999999999999999999 does not fit into 64 bits"), "{told}");
}

#[test]
fn a_missing_cyclic_or_wrong_species_is_named_where_it_stands() {
    let use_it =
        |name: &str| format!("[modules.a]\nuse = 'reef.weed'\nplants = [{{ species = '{name}' }}]\n");
    let place = Place::new(&[
        KELP,
        ("one", "base = 'two'\n"),
        ("two", "base = 'one'\nlength = 1\n"),
        ("lost", "length = 1\nbase = 'nobody'\n"),
        ("odd", "base = 'kelp'\nlenght = 3\n"),
        ("short", "look = {}\n"),
        ("low", "base = 'kelp'\nlength = -1\n"),
    ]);
    place.load(use_it("kelp")).expect("a good scene");
    for (name, wanted) in [
        (
            "kilp",
            "scene.toml:3:23: modules.a.plants[0].species: there is no species \"kilp\"; known here and in",
        ),
        ("../scene", "scene.toml:3:23: modules.a.plants[0].species: \"../scene\" is no name of a species"),
        ("one", "species/two.toml:1:8: base: this species builds on itself: one → two → one"),
        ("lost", "species/lost.toml:2:8: base: there is no species \"nobody\""),
        ("odd", "species/odd.toml:2:1: lenght: is not known; allowed here: length, height, width, look"),
        ("short", "species/short.toml:1:1: the species \"short\" lacks the key `length`"),
        ("low", "species/low.toml:2:10: length: is -1, but must be a number at least 0"),
    ] {
        let (told, _) = place.error(use_it(name));
        assert!(told.starts_with(wanted), "\n   wanted {wanted}\n      got {told}");
    }
    let own = format!("{}[species.mine]\nbase = 'kelp'\nlength = 'x'\n", use_it("mine"));
    let (told, _) = place.error(own);
    assert!(told.starts_with("scene.toml:6:10: species.mine.length: is text"), "{told}");
}

#[test]
fn what_a_plugin_says_about_its_configuration_is_told_at_its_place() {
    let place = Place::new(&[KELP]);
    let text = "[modules.a]\nuse = 'reef.weed'\nplants = [\n  { species = 'kelp' },\n  { species = 'kelp', nodes = 9 },\n]\n";
    let scene = place.load(text).expect("a good scene");
    let told = |message: &str| {
        let error = scene.modules[0].create_error(message).to_string();
        error.replace(&format!("{}/", place.0.path().display()), "")
    };
    assert_eq!(told("plants[1].nodes: too few"), "scene.toml:5:31: modules.a.plants[1].nodes: too few");
    assert_eq!(told("species.kelp.length: too long"), "species/kelp.toml:1:10: length: too long");
    assert_eq!(told("no memory"), "scene.toml:1:10: modules.a: the plugin \"reef.weed\" refused: no memory");
}
