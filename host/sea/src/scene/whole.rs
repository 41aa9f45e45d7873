//! What only makes sense when a scene is looked at as a whole: order of keyframes, directions, sizes, names.

use reef_flow::{
    keyframe::{Animate, TrackError},
    waves::spectrum::significant_height,
};

use super::{
    document::{Node, Path},
    error::Fault,
    flow_tables::FlowTable,
    format::{MOST_HEIGHTS, MOST_MODULES, MOST_ROCKS, MOST_WAVES, SceneFile},
    keyed::Keyed,
    words::{did_you_mean, nearest},
};

/// A random sea's significant height over the water's depth where its waves break (Thornton & Guza 1982).
const BREAKING: f64 = 0.6;

/// Cells of the terrain's noise from one end to the other at most: beyond, its numbers are too coarse to tell
/// two apart.
const MOST_CELLS: f64 = 4e6;

/// All such faults of a file.
pub fn check_whole(file: &SceneFile, node: &Node) -> Vec<Fault> {
    let mut whole = Whole { node, faults: Vec::new() };
    whole.camera(file);
    whole.terrain(file);
    whole.flow(file);
    whole.waves(file);
    for (at, obstacle) in file.obstacle.iter().enumerate() {
        whole.keys(&obstacle.motion, &Path::default().key("obstacle").index(at).key("motion"));
    }
    whole.modules(file);
    whole.faults
}

struct Whole<'a> {
    node: &'a Node,
    faults: Vec<Fault>,
}

impl Whole<'_> {
    fn fault(&mut self, path: &Path, problem: impl Into<String>, help: Option<String>) {
        self.faults.push(Fault {
            span: self.node.locate(path),
            path: path.clone(),
            problem: problem.into(),
            help,
        });
    }

    fn camera(&mut self, file: &SceneFile) {
        let path = Path::default().key("camera");
        let camera = &file.camera;
        self.keys(&camera.position, &path.key("position"));
        self.keys(&camera.look_at, &path.key("look_at"));
        if camera.far <= camera.near {
            let problem = format!("is {}, but must be above `near`, which is {}", camera.far, camera.near);
            self.fault(&path.key("far"), problem, None);
        }
        let has = |key: &str| self.node.has(&path.key(key));
        if camera.orbit.is_some() && (has("position") || has("look_at")) {
            self.fault(
                &path.key("orbit"),
                "takes the place of `position` and `look_at`: write one or the other",
                None,
            );
        }
        if let (None, Keyed::Fixed(eye), Keyed::Fixed(target)) =
            (&camera.orbit, &camera.position, &camera.look_at)
            && eye == target
        {
            self.fault(&path.key("look_at"), "must not be the camera's own position", None);
        }
    }

    fn terrain(&mut self, file: &SceneFile) {
        let Some(terrain) = &file.terrain else { return };
        let path = Path::default().key("terrain");
        let heights = terrain.size.iter().map(|size| (size / terrain.cell).ceil() + 1.0).product::<f64>();
        if heights > MOST_HEIGHTS as f64 {
            let problem =
                format!("`size` and `cell` together give {heights:.3e} heights; the limit is {MOST_HEIGHTS}");
            self.fault(&path, problem, Some("make `cell` larger or `size` smaller".to_owned()));
        }
        // The finest layer of noise, in its own cells from one end of the bed to the other.
        let longest = terrain.size[0].max(terrain.size[1]).max(terrain.cell);
        let finest = f64::from(1_u32 << (terrain.octaves - 1));
        let cells = longest / terrain.relief_length * finest;
        if cells > MOST_CELLS {
            let problem = format!(
                "gives {cells:.1e} dunes of the finest layer from end to end; the limit is {MOST_CELLS:.1e}"
            );
            let help = format!("write at least {:.3e}, or fewer `octaves`", longest * finest / MOST_CELLS);
            self.fault(&path.key("relief_length"), problem, Some(help));
        }
        if terrain.rocks.count as usize + terrain.rock.len() > MOST_ROCKS as usize {
            self.fault(
                &path.key("rocks"),
                format!("with the listed ones too many rocks; the limit is {MOST_ROCKS}"),
                None,
            );
        }
        let [small, great] = terrain.rocks.size;
        if small > great {
            let problem = format!("is [{small}, {great}], but the smallest must come first");
            self.fault(&path.key("rocks").key("size"), problem, None);
        }
    }

    fn flow(&mut self, file: &SceneFile) {
        for (at, flow) in file.flow.iter().enumerate() {
            let path = Path::default().key("flow").index(at);
            let attach = match flow {
                FlowTable::Source(flow) | FlowTable::Hole(flow) => {
                    self.keys(&flow.position, &path.key("position"));
                    self.keys(&flow.strength, &path.key("strength"));
                    &flow.attach
                }
                FlowTable::Whirlwind(flow) => {
                    self.keys(&flow.position, &path.key("position"));
                    self.keys(&flow.strength, &path.key("strength"));
                    self.keys(&flow.axis, &path.key("axis"));
                    self.direction(&flow.axis, &path.key("axis"));
                    &flow.attach
                }
                FlowTable::Directional(flow) => {
                    self.keys(&flow.direction, &path.key("direction"));
                    self.keys(&flow.speed, &path.key("speed"));
                    self.direction(&flow.direction, &path.key("direction"));
                    if flow.travel == Some([0.0; 3]) {
                        self.fault(&path.key("travel"), "must not be zero: it is a direction", None);
                    }
                    &None
                }
                FlowTable::Shelter(flow) => {
                    self.keys(&flow.position, &path.key("position"));
                    self.keys(&flow.strength, &path.key("strength"));
                    if flow.strength.values().any(|value| !(0.0..=1.0).contains(&value)) {
                        self.fault(
                            &path.key("strength"),
                            "must be a number from 0 to 1 (at every key)",
                            None,
                        );
                    }
                    &flow.attach
                }
            };
            if let Some(attach) = attach
                && !file.modules.contains_key(&attach.module)
            {
                let names: Vec<&str> = file.modules.keys().map(String::as_str).collect();
                let help = nearest(&attach.module, names.iter().copied()).map(did_you_mean);
                let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                let problem =
                    format!("there is no module {:?} in this scene; there are: {known}", attach.module);
                self.fault(&path.key("attach").key("module"), problem, help);
            }
        }
    }

    fn waves(&mut self, file: &SceneFile) {
        let Some(waves) = &file.waves else { return };
        let path = Path::default().key("waves");
        let count = waves.trains as usize + file.wave.len();
        if count > MOST_WAVES as usize {
            let problem =
                format!("makes {count} wave trains with the listed ones; the limit is {MOST_WAVES}");
            self.fault(&path.key("trains"), problem, None);
        }
        // In metres: the height grows with the square of the wind, so the scale does not cancel.
        let scale = file.scene.scale;
        let (wind, depth) = (waves.wind * scale, file.water.depth * scale);
        let (height, most) = (significant_height(wind), BREAKING * depth);
        if height > most {
            let allowed = waves.wind * (most / height).sqrt();
            let problem = format!(
                "raises waves of {height:.2} m, but they break above {most:.2} m in water that is {depth:.2} m deep"
            );
            let help = format!("write at most {:.2}, or make `water.depth` greater", floor(allowed));
            self.fault(&path.key("wind"), problem, Some(help));
        }
    }

    fn modules(&mut self, file: &SceneFile) {
        let path = Path::default().key("modules");
        if file.modules.len() > MOST_MODULES {
            let problem = format!("has {} modules; the limit is {MOST_MODULES}", file.modules.len());
            self.fault(&path, problem, None);
        }
        for name in file.modules.keys() {
            let sound = !name.is_empty()
                && name.len() <= 100
                && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
            if !sound {
                let problem = "is no name for a module; allowed are up to 100 letters, digits, `-` and `_`";
                self.fault(&path.key(name), problem, None);
            }
        }
    }

    fn keys<T: Animate>(&mut self, value: &Keyed<T>, path: &Path) {
        match value.track() {
            Ok(_) => {}
            Err(TrackError::Empty) => self.fault(&path.key("keys"), "must have at least one key", None),
            Err(TrackError::Order { key }) => {
                let path = path.key("keys").index(key).key("time");
                self.fault(&path, "must be after the time of the key before it", None);
            }
        }
    }

    fn direction(&mut self, value: &Keyed<[f64; 3]>, path: &Path) {
        if value.values().any(|value| value.iter().map(|x| x * x).sum::<f64>() < 1e-24) {
            self.fault(path, "must not be zero: it is a direction", None);
        }
    }
}

/// A number's first two digits behind the point, never rounded up.
fn floor(value: f64) -> f64 {
    (value * 100.0).floor() / 100.0
}

/// Linear red, green and blue of "#RRGGBB".
pub fn parse_color(text: &str) -> Option<[f32; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let channel = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).ok().map(linear);
    Some([channel(0)?, channel(2)?, channel(4)?])
}

/// Linear light of an sRGB channel.
fn linear(byte: u8) -> f32 {
    let value = f64::from(byte) / 255.0;
    let linear = if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
    linear as f32
}
