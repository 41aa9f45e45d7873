//! The module's table in a scene file.

use reef_flow::random::mix;
use reef_sdk::ConfigError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::kind::{Kind, Orientation};

/// Most boxes of a module.
pub const MOST_BOXES: usize = 256;
/// Most particles of a module, all boxes together.
pub const MOST_PARTICLES: u64 = 4_000_000;
/// Most slaves that follow one master.
pub const MOST_SLAVES: u32 = 15;
/// Greatest extent of a box [m]: its offsets from the middle are f32 in the streams.
pub const GREATEST_EXTENT: f64 = 2000.0;
/// Least extent of a box [m].
pub const LEAST_EXTENT: f64 = 1e-3;

/// What the particle module puts into a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Boxes of particles. They may overlap.
    #[schemars(length(max = 256))]
    pub boxes: Vec<BoxTable>,
    /// Slaves that follow each master beyond the distance D_m (parameter `master_distance`).
    #[schemars(range(min = 0, max = 15))]
    pub slaves: u32,
}

impl Default for Config {
    fn default() -> Self {
        Self { boxes: Vec::new(), slaves: 3 }
    }
}

/// A box of particles of one kind. Their number never changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxTable {
    /// What they are. Everything below has a default for each kind.
    #[serde(default)]
    pub kind: Kind,
    /// The corner with the least x, y and z.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub low: [f64; 3],
    /// The corner with the greatest x, y and z.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub high: [f64; 3],
    /// How many there are. Without it: as the concentration says.
    #[serde(default)]
    #[schemars(range(max = 4000000))]
    pub count: Option<u32>,
    /// How many there are in a cubic metre, in place of their number. Without either: 200 of clay, 100 of
    /// sand, 40 of phytoplankton and detritus, 20 of plankton.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e9), extend("x-unit" = "1/m³"))]
    pub concentration: Option<f64>,
    /// Columns along x, y and z of a regular grid, in place of chance; then `count` and `concentration` are
    /// not given.
    #[serde(default)]
    #[schemars(inner(range(min = 1, max = 4000000)))]
    pub grid: Option<[u32; 3]>,
    /// Least and greatest diameter; small ones are more.
    #[serde(default)]
    #[schemars(inner(range(min = 1e-9, max = 10.0)), extend("x-unit" = "m"))]
    pub size: Option<[f64; 2]>,
    /// How much one covers.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub opacity: Option<f64>,
    /// Colour, like "#E6E3D8"; the picture of the kind is tinted with it.
    #[serde(default)]
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub color: Option<String>,
    /// How much lighter or darker one is than the next.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub variation: Option<f64>,
    /// Whose picture they have. Without it: that of their kind; "dot": a soft round dot.
    #[serde(default)]
    pub texture: Option<Picture>,
    /// How they lie.
    #[serde(default)]
    pub orientation: Option<Orientation>,
    /// d_pmin and d_pmax: how far from its master a slave is; one that the currents take elsewhere rides by
    /// itself. Without it: from a tenth of the mean distance of neighbours to 1.5 times the width of the
    /// water that a master and its slaves have to themselves.
    #[serde(default)]
    #[schemars(inner(range(min = 0.0, max = 1000.0)), extend("x-unit" = "m"))]
    pub follow: Option<[f64; 2]>,
    /// Seed of the places. Without it: its place in the list.
    #[serde(default)]
    pub seed: Option<u32>,
}

/// A picture for particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Picture {
    /// Of sand.
    Sand,
    /// Of clay.
    Clay,
    /// Of phytoplankton.
    Phytoplankton,
    /// Of detritus.
    Detritus,
    /// Of plankton.
    Plankton,
    /// A soft round dot.
    Dot,
}

impl Picture {
    /// The kind whose picture it is; None: the dot.
    pub fn kind(self) -> Option<Kind> {
        match self {
            Self::Sand => Some(Kind::Sand),
            Self::Clay => Some(Kind::Clay),
            Self::Phytoplankton => Some(Kind::Phytoplankton),
            Self::Detritus => Some(Kind::Detritus),
            Self::Plankton => Some(Kind::Plankton),
            Self::Dot => None,
        }
    }
}

/// A box that was checked, in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxPlan {
    /// Middle [m, world].
    pub center: [f64; 3],
    /// [m]
    pub extent: [f64; 3],
    /// How many.
    pub count: u32,
    /// Regular grid.
    pub grid: Option<[u32; 3]>,
    /// Least and greatest diameter [m].
    pub size: [f64; 2],
    /// 0..1
    pub opacity: f64,
    /// sRGB 0xRRGGBB.
    pub color: u32,
    /// 0..1
    pub variation: f64,
    /// None: the dot.
    pub picture: Option<Kind>,
    /// How they lie.
    pub orientation: Orientation,
    /// d_pmin, d_pmax [m].
    pub follow: [f64; 2],
    /// Of places and looks.
    pub seed: u64,
}

/// Checks a configuration and fills in what it leaves open. The seed is the scene's.
pub fn plan(config: &Config, seed: u64) -> Result<Vec<BoxPlan>, ConfigError> {
    if config.boxes.len() > MOST_BOXES {
        let count = config.boxes.len();
        return Err(ConfigError::new("boxes", format!("has {count} boxes; the limit is {MOST_BOXES}")));
    }
    if config.slaves > MOST_SLAVES {
        let slaves = config.slaves;
        return Err(ConfigError::new("slaves", format!("is {slaves}; the limit is {MOST_SLAVES}")));
    }
    let mut plans = Vec::new();
    let mut total = 0_u64;
    for (at, table) in config.boxes.iter().enumerate() {
        let plan = plan_box(table, at, config.slaves, seed)
            .map_err(|error| error.within(&format!("boxes[{at}]")))?;
        total += u64::from(plan.count);
        if total > MOST_PARTICLES {
            let key = if table.count.is_some() { "count" } else { "concentration" };
            return Err(too_many(total).within(&format!("boxes[{at}].{key}")));
        }
        plans.push(plan);
    }
    Ok(plans)
}

fn too_many(total: u64) -> ConfigError {
    let message =
        format!("makes {total} particles; the limit is {MOST_PARTICLES} in all boxes of a module together");
    ConfigError::new("", message)
}

fn plan_box(table: &BoxTable, at: usize, slaves: u32, seed: u64) -> Result<BoxPlan, ConfigError> {
    let refuse = |path: &str, message: String| Err(ConfigError::new(path, message));
    let (low, high) = (table.low, table.high);
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        if !(low[i].is_finite() && high[i].is_finite()) {
            return refuse("low", format!("is no place along {axis}"));
        }
        let extent = high[i] - low[i];
        if extent <= 0.0 {
            let (low, high) = (low[i], high[i]);
            return refuse("high", format!("must lie beyond `low` along {axis}: {high} is not above {low}"));
        }
        if !(LEAST_EXTENT..=GREATEST_EXTENT).contains(&extent) {
            return refuse(
                "high",
                format!(
                    "makes a box of {extent} m along {axis}; allowed is {LEAST_EXTENT} to {GREATEST_EXTENT} m"
                ),
            );
        }
    }
    let extent: [f64; 3] = core::array::from_fn(|i| high[i] - low[i]);
    let volume = extent[0] * extent[1] * extent[2];
    let defaults = table.kind.defaults();
    let count = match (table.count, table.concentration, table.grid) {
        (Some(_), Some(_), _) => {
            return refuse("concentration", "stands beside `count`; only one of them counts".into());
        }
        (None, None, Some([x, y, z])) => {
            u64::from(x).saturating_mul(u64::from(y)).saturating_mul(u64::from(z))
        }
        (_, _, Some(_)) => {
            return refuse(
                "grid",
                "stands beside `count` or `concentration`; only one of them counts".into(),
            );
        }
        (Some(count), None, None) => u64::from(count),
        (None, concentration, None) => {
            let wanted = concentration.unwrap_or(defaults.concentration);
            if !(0.0..=1e18).contains(&wanted) {
                return refuse("concentration", format!("must be at least 0, is {wanted}"));
            }
            // A cast saturates.
            (wanted * volume).round() as u64
        }
    };
    if count > MOST_PARTICLES {
        let key = match (table.count, table.grid) {
            (Some(_), _) => "count",
            (_, Some(_)) => "grid",
            _ => "concentration",
        };
        return Err(too_many(count).within(key));
    }
    let size = table.size.unwrap_or(defaults.size);
    if !(size[0] > 0.0 && size[1] >= size[0] && size[1] <= 10.0) {
        return refuse("size", "must be a least and a greatest diameter above 0, at most 10 m".into());
    }
    let share = |path: &str, value: Option<f64>, default: f64| match value.unwrap_or(default) {
        value if (0.0..=1.0).contains(&value) => Ok(value),
        value => Err(ConfigError::new(path, format!("must be from 0 to 1, is {value}"))),
    };
    let per_master = f64::from(slaves + 1);
    let follow = match table.follow {
        Some([least, most]) if least >= 0.0 && most >= least && most.is_finite() => [least, most],
        Some(_) => return refuse("follow", "must be a least and a greatest distance".into()),
        None => {
            let own = volume / (count as f64).max(1.0);
            [0.1 * width(extent, own), 1.5 * width(extent, per_master * own)]
        }
    };
    Ok(BoxPlan {
        center: core::array::from_fn(|i| 0.5 * (low[i] + high[i])),
        extent,
        // At most MOST_PARTICLES.
        count: count as u32,
        grid: table.grid,
        size,
        opacity: share("opacity", table.opacity, defaults.opacity)?,
        color: color(table.color.as_deref(), defaults.color)?,
        variation: share("variation", table.variation, defaults.variation)?,
        picture: table.texture.map_or(Some(table.kind), Picture::kind),
        orientation: table.orientation.unwrap_or(defaults.orientation),
        follow,
        seed: mix(seed ^ mix(table.seed.map_or(at as u64, |s| 1 << 32 | u64::from(s)))),
    })
}

fn color(text: Option<&str>, default: u32) -> Result<u32, ConfigError> {
    let Some(text) = text else { return Ok(default) };
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6);
    digits.and_then(|digits| u32::from_str_radix(digits, 16).ok()).ok_or_else(|| {
        ConfigError::new("color", format!("{text:?} is no colour; write one like \"#E6E3D8\""))
    })
}

/// Width of a part of a box, about as long as wide [m]: as high as the box where that is flatter. `volume`:
/// of the part [m³].
fn width(extent: [f64; 3], volume: f64) -> f64 {
    let mut sides = extent;
    sides.sort_by(f64::total_cmp);
    let [least, middle, _] = sides;
    let cube = cube_root(volume);
    let square = (volume / least).sqrt();
    if cube <= least {
        cube
    } else if square <= middle {
        square
    } else {
        volume / (least * middle)
    }
}

/// ∛x for x ≥ 0, the same on every machine.
fn cube_root(x: f64) -> f64 {
    glam::DVec2::splat(x).powf(1.0 / 3.0).x
}
