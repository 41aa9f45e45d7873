//! What the muscles are told (§3.3, figure 4).

/// Share of the period in which all muscles contract, and up to which they hold.
const CONTRACTED: f64 = 0.12;
const HELD: f64 = 0.22;
/// Share of the period after which a muscle next to the apex is as long as at rest again; at the margin: 1.
const APEX_BACK: f64 = 0.53;
/// By which share of its length a muscle contracts at full strength: down to 0.46 of it (figure 3).
pub const CONTRACTION: f64 = 0.54;
/// Lowest and highest frequency [Hz].
pub const FREQUENCIES: [f64; 2] = [0.05, 5.0];

/// How it swims.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gait {
    /// Contractions a second [Hz].
    pub frequency: f64,
    /// How far the muscles contract: 0 is idle, 1 is all the way.
    pub strength: f64,
    /// By which angle each joint of the bell bends toward one side while it contracts [rad]; positive turns
    /// it toward positive x.
    pub turn: f64,
}

impl Default for Gait {
    fn default() -> Self {
        Self { frequency: 0.7, strength: 1.0, turn: 0.0 }
    }
}

impl Gait {
    /// Whether an animal can swim like this.
    ///
    /// # Errors
    /// The key, what is wrong with it, and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        let [lowest, highest] = FREQUENCIES;
        if !(lowest..=highest).contains(&self.frequency) {
            return Err(format!("frequency must be {lowest} to {highest} Hz, is {}", self.frequency));
        }
        if !(0.0..=1.0).contains(&self.strength) {
            return Err(format!("strength must be 0 to 1, is {}", self.strength));
        }
        if !(-TURN..=TURN).contains(&self.turn) {
            return Err(format!("turn must be {} to {TURN} rad, is {}", -TURN, self.turn));
        }
        Ok(())
    }

    /// Rest length of a muscle over its length at rest, at a share of the period; `place`: 0 next to the
    /// apex, 1 at the margin. A periodic Hermite spline whose slope is 0 at each of its keys; the apex
    /// expands faster than the margin.
    pub fn rest_length(&self, phase: f64, place: f64) -> f64 {
        1.0 - self.strength * CONTRACTION * contraction(phase, place)
    }

    /// How far the muscles of the margin have contracted: 0 to 1.
    pub fn contraction(&self, phase: f64) -> f64 {
        self.strength * contraction(phase, 1.0)
    }
}

/// Most that a joint bends to turn the animal [rad].
pub const TURN: f64 = 0.2;

fn contraction(phase: f64, place: f64) -> f64 {
    let back = APEX_BACK + (1.0 - APEX_BACK) * place;
    if phase < CONTRACTED {
        hermite(phase / CONTRACTED)
    } else if phase < HELD {
        1.0
    } else if phase < back {
        1.0 - hermite((phase - HELD) / (back - HELD))
    } else {
        0.0
    }
}

/// From 0 to 1 with slope 0 at both ends.
fn hermite(u: f64) -> f64 {
    u * u * (3.0 - 2.0 * u)
}
