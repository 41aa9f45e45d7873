//! The scene's waves: trains that the wind raises and trains that the scene lists, the same for every module,
//! the caustics and whatever else feels or shows them.

use std::f64::consts::TAU;

use reef_abi as abi;
use reef_flow::waves::{Train, WindSea, WindSeaError, dispersion};

use super::random::Random;
use crate::scene::format::SceneFile;

/// All wave trains of a scene, greatest amplitude first.
#[derive(Clone, Debug, PartialEq)]
pub struct Waves {
    trains: Vec<Train>,
}

impl Waves {
    /// The trains of a scene whose lengths are in metres. Each obeys ω² = g k tanh(k h).
    pub fn new(file: &SceneFile, seed: u64) -> Result<Self, WindSeaError> {
        let depth = file.water.depth;
        // A sequence for each, so that a wind sea changes nothing about the listed trains.
        let mut random = Random::new(seed, "waves");
        let listed = file.wave.iter().map(|table| {
            let wave_number = TAU / table.wavelength;
            let chance = random.unit() * TAU;
            Train {
                amplitude: table.amplitude,
                wave_number,
                frequency: dispersion::frequency(wave_number, depth),
                heading: table.direction.to_radians(),
                phase: table.phase.map_or(chance, f64::to_radians),
            }
        });
        let mut trains: Vec<Train> = listed.collect();
        if let Some(table) = &file.waves {
            let sea = WindSea {
                wind: table.wind,
                heading: table.direction.to_radians(),
                depth,
                trains: table.trains,
            };
            let mut random = Random::new(seed, "wind sea");
            trains.extend(sea.trains(&mut || random.unit())?);
        }
        trains.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        Ok(Self { trains })
    }

    /// The trains as plugins see them at a time [s], in place of what `waves` held. Allocates nothing once it
    /// has room.
    pub fn fill(&self, time: f64, waves: &mut Vec<abi::Wave>) {
        waves.clear();
        waves.extend(self.trains.iter().map(|train| train.at(time)));
    }

    /// The same in a list of its own.
    pub fn at(&self, time: f64) -> Vec<abi::Wave> {
        let mut waves = Vec::with_capacity(self.trains.len());
        self.fill(time, &mut waves);
        waves
    }
}

#[cfg(test)]
mod tests {
    use reef_flow::waves::{GRAVITY, spectrum::significant_height};

    use super::*;
    use crate::scene::wave_tables::{WaveTable, WavesTable};

    fn file(depth: f64, waves: Option<WavesTable>, wave: Vec<WaveTable>) -> SceneFile {
        let mut file = SceneFile { waves, wave, ..SceneFile::default() };
        file.water.depth = depth;
        file
    }

    fn breeze() -> WavesTable {
        WavesTable { wind: 5.0, direction: 90.0, trains: 30 }
    }

    fn swell(wavelength: f64, phase: Option<f64>) -> WaveTable {
        WaveTable { amplitude: 0.1, wavelength, direction: 0.0, phase }
    }

    #[test]
    fn listed_waves_obey_the_dispersion_relation_in_deep_and_shallow_water() {
        let wave = |wavelength, depth| {
            let file = file(depth, None, vec![swell(wavelength, Some(0.0))]);
            Waves::new(&file, 1).expect("no wind sea to refuse").at(0.0)[0]
        };
        let deep = wave(2.0, 100.0);
        assert!((f64::from(deep.frequency) - (GRAVITY * TAU / 2.0).sqrt()).abs() < 1e-5);
        let shallow = wave(200.0, 0.5);
        // Long waves travel at sqrt(g h); the next term is (k h)²/6 = 4e-5.
        let speed = f64::from(shallow.frequency / shallow.wave_number);
        assert!((speed / (GRAVITY * 0.5).sqrt() - 1.0).abs() < 5e-5, "{speed}");
    }

    #[test]
    fn wind_and_list_make_one_sea_greatest_first_and_the_list_keeps_its_phases() {
        // One greater than all of the wind's, one less than most.
        let list = vec![WaveTable { amplitude: 0.01, ..swell(12.0, None) }, swell(7.0, Some(30.0))];
        let alone = Waves::new(&file(5.0, None, list.clone()), 4).expect("sound").at(2.0);
        let both = Waves::new(&file(5.0, Some(breeze()), list), 4).expect("sound").at(2.0);
        assert_eq!((alone.len(), both.len()), (2, 32));
        assert!(alone.iter().all(|wave| both.contains(wave)));
        assert!(both.windows(2).all(|pair| pair[0].amplitude >= pair[1].amplitude));
        let energy: f64 = both.iter().map(|w| 0.5 * f64::from(w.amplitude).powi(2)).sum();
        let wind = energy - 0.5 * (0.1 * 0.1 + 0.01 * 0.01);
        assert!((4.0 * wind.sqrt() / significant_height(5.0) - 1.0).abs() < 1e-6);
        let raised = both.iter().filter(|wave| !alone.contains(wave));
        let [x, z] = raised.fold([0.0; 2], |sum: [f32; 2], wave| {
            let energy = wave.amplitude * wave.amplitude;
            [sum[0] + energy * wave.direction[0], sum[1] + energy * wave.direction[1]]
        });
        assert!(z > 0.0 && z > 2.0 * x.abs(), "most of it goes where the wind blows: {x} {z}");
    }

    #[test]
    fn seeds_give_seas_of_their_own_and_time_turns_the_phases_alone() {
        let sea = |seed| Waves::new(&file(5.0, Some(breeze()), Vec::new()), seed).expect("sound");
        assert_eq!(sea(1), sea(1));
        assert_ne!(sea(1).at(0.0), sea(2).at(0.0));
        let (early, late) = (sea(1).at(0.0), sea(1).at(1e6));
        for (a, b) in early.iter().zip(&late) {
            assert_eq!((a.amplitude, a.wave_number, a.direction), (b.amplitude, b.wave_number, b.direction));
            assert!((0.0..=TAU as f32).contains(&b.phase));
        }
    }

    #[test]
    fn a_calm_is_a_still_sea() {
        let calm = WavesTable { wind: 0.0, ..breeze() };
        assert_eq!(Waves::new(&file(5.0, Some(calm), Vec::new()), 1).expect("sound").at(3.0), []);
    }
}
