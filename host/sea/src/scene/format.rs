//! The keys of a scene file: names, units, ranges, defaults. The JSON Schema, the checker,
//! `reef scene schema` and the reference in assets/scenes are made from these types; their doc comments are
//! what a reader of the reference sees.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value as Json};

use super::{
    flow_tables::FlowTable,
    keyed::Keyed,
    terrain_tables::TerrainTable,
    wave_tables::{WaveTable, WavesTable},
};

/// Most primitives that a scene may list.
pub const MOST_FLOWS: u32 = 4096;
/// Most obstacles that a scene may list.
pub const MOST_OBSTACLES: u32 = 4096;
/// Most rocks, listed and scattered.
pub const MOST_ROCKS: u32 = 10_000;
/// Most heights of a terrain.
pub const MOST_HEIGHTS: u64 = 4_000_000;
/// Most modules of a scene.
pub const MOST_MODULES: usize = 64;
/// Metres per unit of length.
pub const SCALES: std::ops::RangeInclusive<f64> = 1e-6..=1e6;
/// Most wave trains, listed and raised by the wind.
pub const MOST_WAVES: u32 = 256;

/// A scene: what is in the sea, how it is lit and looked at.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SceneFile {
    /// What the scene is called and how its clock runs.
    pub scene: SceneTable,
    /// Where the scene is looked at from.
    pub camera: CameraTable,
    /// The water.
    pub water: WaterTable,
    /// The sun above it.
    pub light: LightTable,
    /// The sea bed. Without this table there is no ground: open water.
    pub terrain: Option<TerrainTable>,
    /// What moves the water: sources, holes, whirlwinds, currents. Their velocities add up.
    #[schemars(length(max = 4096))]
    pub flow: Vec<FlowTable>,
    /// A wind sea: the waves of a wind that has blown for so long and over so far a sea that they grow no
    /// more (the spectrum of Pierson and Moskowitz, as a sum of wave trains). Their significant height is
    /// 0.209 wind²/g, at most 0.6 of the water's depth: higher ones would break. Without this table there are
    /// no waves but the listed ones.
    pub waves: Option<WavesTable>,
    /// Wave trains on the surface one by one, beside those of the wind sea: a swell, say.
    #[schemars(length(max = 256))]
    pub wave: Vec<WaveTable>,
    /// Capsules that nothing enters.
    #[schemars(length(max = 4096))]
    pub obstacle: Vec<ObstacleTable>,
    /// What lives in the sea: one table for each module, under a name of your choice.
    #[schemars(extend("maxProperties" = 64))]
    pub modules: BTreeMap<String, ModuleTable>,
    /// Species that only this scene knows, or its own version of one in assets/species. `base` names the
    /// species that a table builds on; all other keys are the module's.
    pub species: BTreeMap<String, Map<String, Json>>,
}

/// What the scene is called and how its clock runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SceneTable {
    /// Name, as the window shows it. Without it: the file's name.
    #[schemars(length(max = 200))]
    pub name: String,
    /// One or two sentences about what there is to see.
    #[schemars(length(max = 2000))]
    pub description: String,
    /// Seed of everything random. The same seed gives the same sea.
    #[schemars(range(min = 0))]
    pub seed: u64,
    /// Length of a simulation step.
    #[schemars(range(min = 1e-5, max = 10.0), extend("x-unit" = "s"))]
    pub dt: f64,
    /// Metres per unit of length of this file. All lengths of the file are multiplied by it, speeds, too,
    /// strengths of sources, holes and whirlwinds by its cube, and what is per metre is divided: so a scene
    /// can keep the numbers of a paper that has no metres. Presets of the water's optics and units of matter
    /// (kg/m³, N, N/m, Pa·s) are not touched.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub scale: f64,
    /// How long the scene is worth watching: what is rendered when nothing else is asked for.
    #[schemars(range(min = 0.0, max = 86400.0), extend("x-unit" = "s"))]
    pub duration: f64,
    /// A plain background colour, like "#F4F4F0", in place of water and fog: for diagrams.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub background: Option<String>,
    /// Draw the modules' debug lines (forces, moments, axes) from the start.
    pub debug: bool,
    /// Draw sources green, holes red, whirlwinds yellow with their axes, and white what an object carries:
    /// balls of the size of their `core`.
    pub singularities: bool,
    /// Draw the bounding spheres of plants, orange where a singularity reaches one so that its field is
    /// evaluated there, and the spheres in which singularities end (`reach`), dashed where they begin to
    /// fade.
    pub bounds: bool,
    /// When the pictures are taken that `reef validate` keeps. Without it: one in the middle of `duration`.
    #[schemars(length(max = 8), inner(range(min = 0.0, max = 86400.0)), extend("x-unit" = "s"))]
    pub moments: Vec<f64>,
}

impl Default for SceneTable {
    fn default() -> Self {
        Self {
            name: String::new(),
            description: String::new(),
            seed: 1,
            dt: 1.0 / 60.0,
            scale: 1.0,
            duration: 10.0,
            background: None,
            debug: false,
            singularities: false,
            bounds: false,
            moments: Vec::new(),
        }
    }
}

/// Where the scene is looked at from. Either `position` and `look_at`, each fixed or keyframed, or `orbit`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CameraTable {
    /// Vertical angle of view.
    #[schemars(range(min = 1.0, max = 170.0), extend("x-unit" = "deg"))]
    pub fov: f64,
    /// Width and height of the picture that modules are told about (level of detail, culling); a window of
    /// any size shows the same sea.
    #[schemars(inner(range(min = 1, max = 16384)), extend("x-unit" = "px"))]
    pub viewport: [u32; 2],
    /// The nearest thing that is drawn.
    #[schemars(range(max = 1000.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub near: f64,
    /// The farthest thing that is drawn.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub far: f64,
    /// The eye: a point, or keyframes.
    #[schemars(extend("x-unit" = "m"))]
    pub position: Keyed<[f64; 3]>,
    /// The point in the middle of the picture: a point, or keyframes.
    #[schemars(extend("x-unit" = "m"))]
    pub look_at: Keyed<[f64; 3]>,
    /// Circle around a point, in place of `position` and `look_at`.
    pub orbit: Option<OrbitTable>,
}

impl Default for CameraTable {
    fn default() -> Self {
        Self {
            fov: 55.0,
            viewport: [1280, 720],
            near: 0.02,
            far: 200.0,
            position: Keyed::Fixed([0.0, -4.2, 4.0]),
            look_at: Keyed::Fixed([0.0, -4.6, 0.0]),
            orbit: None,
        }
    }
}

/// A camera that circles around a point at constant speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OrbitTable {
    /// The point in the middle of the picture.
    #[schemars(extend("x-unit" = "m"))]
    pub center: [f64; 3],
    /// Distance from the vertical through the centre.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub radius: f64,
    /// Height of the eye above the centre.
    #[schemars(extend("x-unit" = "m"))]
    pub height: f64,
    /// Time for one round; negative: clockwise as seen from above; 0: stands still.
    #[schemars(extend("x-unit" = "s"))]
    pub period: f64,
    /// Where the round begins: 0 on the +z side, 90 on the +x side.
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub start: f64,
}

impl Default for OrbitTable {
    fn default() -> Self {
        Self { center: [0.0; 3], radius: 3.0, height: 0.8, period: 60.0, start: 0.0 }
    }
}

/// The water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WaterTable {
    /// How water colours light: a preset, or coefficients.
    pub optics: Optics,
    /// Density of the water.
    #[schemars(range(min = 1.0, max = 20000.0), extend("x-unit" = "kg/m³"))]
    pub density: f64,
    /// Dynamic viscosity of the water.
    #[schemars(range(min = 1e-7, max = 1000.0), extend("x-unit" = "Pa·s"))]
    pub viscosity: f64,
    /// Depth: the bed lies around y = −depth, still water at y = 0.
    #[schemars(range(max = 11000.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub depth: f64,
}

impl Default for WaterTable {
    fn default() -> Self {
        Self { optics: Optics::Preset(OpticsPreset::Reef), density: 1025.0, viscosity: 1.08e-3, depth: 5.0 }
    }
}

/// How water colours light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Optics {
    /// A kind of water by name.
    Preset(OpticsPreset),
    /// Own coefficients.
    Own(OpticsTable),
}

/// Kinds of water.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum OpticsPreset {
    /// Kind to warm colours: the default.
    #[serde(rename = "reef")]
    Reef,
    /// Jerlov's type IB: clear ocean.
    IB,
    /// Jerlov's type II: ocean.
    II,
    /// Jerlov's type III: green ocean.
    III,
    /// Jerlov's type 1C: clear coast.
    #[serde(rename = "1C")]
    OneC,
}

/// Own optical coefficients, red, green, blue (620, 540, 460 nm).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpticsTable {
    /// Beam attenuation c along a view ray.
    #[schemars(inner(range(min = 0.0, max = 100.0)), extend("x-unit" = "1/m"))]
    pub beam: [f64; 3],
    /// Attenuation Kd of sunlight with depth.
    #[schemars(inner(range(min = 0.0, max = 100.0)), extend("x-unit" = "1/m"))]
    pub downwelling: [f64; 3],
    /// Light scattered toward the viewer at the surface (linear; white is 1).
    #[schemars(inner(range(min = 0.0, max = 10.0)))]
    pub scattered: [f64; 3],
}

/// The sun above the water; under water it stands steeper (index 1.33).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LightTable {
    /// Height of the sun over the horizon.
    #[schemars(range(min = 1.0, max = 90.0), extend("x-unit" = "deg"))]
    pub elevation: f64,
    /// Where the sun stands: 0 on the +z side, 90 on the +x side.
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub azimuth: f64,
    /// Direct light just below the surface (linear red, green, blue; white is 1).
    #[schemars(inner(range(min = 0.0, max = 100.0)))]
    pub color: [f64; 3],
    /// Light from the whole hemisphere just below the surface (linear red, green, blue).
    #[schemars(inner(range(min = 0.0, max = 100.0)))]
    pub ambient: [f64; 3],
    /// How bright the shafts of light in the water are, as a multiple; 0: there are none. They are seen from
    /// below the surface, at high quality.
    #[schemars(range(min = 0.0, max = 4.0))]
    pub shafts: f64,
}

impl Default for LightTable {
    fn default() -> Self {
        Self {
            elevation: 62.0,
            azimuth: 150.0,
            color: [1.0, 0.97, 0.9],
            ambient: [0.34, 0.44, 0.5],
            shafts: 1.0,
        }
    }
}

/// A capsule that nothing enters. It is felt, not drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObstacleTable {
    /// A name for the panel.
    #[serde(default)]
    #[schemars(length(max = 200))]
    pub name: String,
    /// One end of its axis.
    #[schemars(extend("x-unit" = "m"))]
    pub from: [f64; 3],
    /// The other end; the same point makes a ball.
    #[schemars(extend("x-unit" = "m"))]
    pub to: [f64; 3],
    /// Its radius.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub radius: f64,
    /// Keyframes that move it as a whole, added to both ends.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m"))]
    pub motion: Keyed<[f64; 3]>,
}

/// A module: a plugin with its configuration. All keys but these are the plugin's own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModuleTable {
    /// The plugin's id, as `reef plugin list` shows it: "reef.anemone".
    #[serde(rename = "use")]
    #[schemars(length(min = 1, max = 200))]
    pub plugin: String,
    /// Parameters that the panel shows, with other values than their defaults from the start.
    #[serde(default)]
    pub params: BTreeMap<String, ParamValue>,
    /// The plugin's own keys.
    #[serde(flatten)]
    pub config: Map<String, Json>,
}

/// Value of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ParamValue {
    /// On or off.
    Switch(bool),
    /// A number.
    Number(f64),
    /// Name of a choice.
    Choice(String),
}

/// The JSON Schema of a scene's own keys, modules' tables left open.
pub fn schema() -> Json {
    let mut schema = schemars::SchemaGenerator::default().into_root_schema_for::<SceneFile>().to_value();
    if let Some(table) = schema.as_object_mut() {
        table.insert("title".to_owned(), "Reef scene".into());
    }
    schema
}
