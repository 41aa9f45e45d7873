//! How a species swims, worked out once from its own mechanics: how fast it is at which beat, how fast it
//! turns at which bias, and its shape over a beat. Fish that are far move by this alone; those that are near
//! ask their muscles by it.

use glam::{DVec3, Vec3};
use reef_flow::Level;
use reef_sdk::Workers;

use crate::{
    Plan,
    body::BodyError,
    frames::axes,
    lanes::WIDTH,
    material::Drive,
    species::Species,
    tank::{Stepping, Swimmer, Tank},
};

/// Shapes of a beat.
pub const PHASES: usize = 16;
/// Beats that are measured: even shares of the fastest.
const BEATS: usize = WIDTH;
/// Sub-steps of a beat at the fastest.
const SUBSTEPS: f64 = 80.0;
/// Steps of a slowest beat: in each the beat of any lane comes to one of its sixteenths, and all of them come
/// up.
const STEPS: usize = PHASES * BEATS;
/// Slowest beats in which it gets to speed.
const SETTLING: usize = 3;
/// A species that swims fewer lengths a second than this at its best does not swim.
const SLOWEST: f64 = 0.02;

/// How a species swims, at its own size.
#[derive(Clone, Debug)]
pub struct Gait {
    /// Its muscles' force.
    pub force: f64,
    /// Their greatest bias.
    pub turn: f64,
    /// How its steps are taken.
    pub stepping: Stepping,
    /// Beats [Hz] and speeds through the water [m/s] that rise together, from none.
    speeds: Vec<[f64; 2]>,
    /// How fast a bias of 1 would turn it to its side [rad/s].
    pub yaw_rate: f64,
    /// How fast a bias of 1 would turn it up [rad/s].
    pub pitch_rate: f64,
    /// Shapes by beat and phase, around its course [m]: nodes of one after the other.
    shapes: Vec<Vec3>,
    nodes: usize,
}

impl Gait {
    /// Lets fish of the species swim.
    ///
    /// # Errors
    /// It does not swim, or not forward.
    pub fn of(species: &Species, plan: &Plan) -> Result<Self, BodyError> {
        let fastest = species.swim.fastest;
        let stepping = Stepping { longest: 1.0 / (SUBSTEPS * fastest), ..Stepping::default() };
        let drive = Drive { force: species.swim.force, ..Drive::default() };
        let nodes = plan.body().nodes().len();
        let mut gait = Self {
            force: drive.force,
            turn: species.swim.turn,
            stepping,
            speeds: vec![[0.0; 2]],
            yaw_rate: 0.0,
            pitch_rate: 0.0,
            shapes: plan.body().nodes().iter().map(|at| at.as_vec3()).collect::<Vec<_>>().repeat(PHASES),
            nodes,
        };
        gait.measure_speeds(plan, fastest, drive);
        let top = gait.top_speed() / plan.body().length();
        if top.is_nan() || top < SLOWEST {
            let problem =
                format!("it swims {top:.4} lengths a second at its best; allowed: at least {SLOWEST}");
            return Err(BodyError { key: "swim".into(), problem });
        }
        gait.measure_turns(plan, fastest, drive);
        Ok(gait)
    }

    /// Eight fish at even shares of the fastest beat.
    fn measure_speeds(&mut self, plan: &Plan, fastest: f64, drive: Drive) {
        let slowest = fastest / BEATS as f64;
        let dt = 1.0 / (slowest * STEPS as f64);
        let beat = |lane: usize| slowest * (lane + 1) as f64;
        let place =
            |lane| Swimmer { drive: Drive { speed: beat(lane), ..drive }, ..Swimmer::at(DVec3::ZERO) };
        let mut tank = Tank::new(plan.clone(), (0..BEATS).map(place).collect(), &[]);
        let step = |tank: &mut Tank| tank.step_all(dt, &self.stepping, Level::best(), Workers::inline());
        (0..SETTLING * STEPS).for_each(|_| step(&mut tank));
        let starts: Vec<DVec3> = (0..BEATS).map(|lane| tank.center(lane)).collect();
        let mut tracks: Vec<Vec<_>> = (0..BEATS).map(|_| Vec::with_capacity(STEPS)).collect();
        for at in 0..STEPS {
            for (lane, track) in tracks.iter_mut().enumerate() {
                // (lane + 1) at / STEPS beats have gone: a sixteenth?
                let sixteenths = (lane + 1) * at;
                if sixteenths.is_multiple_of(BEATS) {
                    let swimmer = &tank.swimmers()[lane];
                    let nodes = tank.positions(lane).iter();
                    let nodes = nodes.map(|at| swimmer.origin + Vec3::from(*at).as_dvec3() - starts[lane]);
                    track.push((sixteenths / BEATS % PHASES, at, nodes.collect::<Vec<DVec3>>()));
                }
            }
            step(&mut tank);
        }
        let seconds = STEPS as f64 * dt;
        for (lane, track) in tracks.iter().enumerate() {
            let way = (tank.center(lane) - starts[lane]) / seconds;
            if way.x <= self.top_speed() || !way.is_finite() {
                // A beat that only shakes it: it swims faster at a slower one.
                continue;
            }
            self.speeds.push([beat(lane), way.x]);
            // Around the mean of where it was over the beat.
            let placed = |at: usize| way * (at as f64 * dt);
            let mut shapes = vec![DVec3::ZERO; PHASES * self.nodes];
            for (phase, at, nodes) in track {
                for (into, node) in shapes[phase * self.nodes..].iter_mut().zip(nodes) {
                    *into = *node - placed(*at);
                }
            }
            let middle = shapes.iter().sum::<DVec3>() / shapes.len() as f64;
            self.shapes.extend(shapes.iter().map(|at| (*at - middle).as_vec3()));
        }
    }

    /// Eight fish at the middle of its beats, half of them with rising biases to the left, half upward.
    fn measure_turns(&mut self, plan: &Plan, fastest: f64, drive: Drive) {
        let beat = 0.5 * fastest.min(self.speeds[self.speeds.len() - 1][0] * 2.0);
        let biases = BEATS / 2;
        let place = |lane: usize| {
            let bias = self.turn * (lane % biases + 1) as f64 / biases as f64;
            let [yaw, pitch] = if lane < biases { [bias, 0.0] } else { [0.0, bias] };
            Swimmer { drive: Drive { speed: beat, yaw, pitch, ..drive }, ..Swimmer::at(DVec3::ZERO) }
        };
        let mut tank = Tank::new(plan.clone(), (0..BEATS).map(place).collect(), &[]);
        let dt = 1.0 / (beat * PHASES as f64);
        // The mean way that each looks, over a beat.
        let look = |tank: &mut Tank| {
            let mut sums = [Vec3::ZERO; BEATS];
            for _ in 0..PHASES {
                tank.step_all(dt, &self.stepping, Level::best(), Workers::inline());
                for (lane, sum) in sums.iter_mut().enumerate() {
                    *sum += axes(plan, tank.positions(lane))[0];
                }
            }
            sums
        };
        for _ in 0..2 {
            look(&mut tank);
        }
        let before = look(&mut tank);
        let after = look(&mut tank);
        let rate = |lane: usize| {
            let angle = |v: Vec3| {
                if lane < biases { f64::from(angle_of(-v.z, v.x)) } else { f64::from(angle_of(v.y, v.x)) }
            };
            (angle(after[lane]) - angle(before[lane])) * beat
        };
        // Per bias, from the smaller half: the sharpest turns are not in proportion.
        let gain = |first: usize| {
            let of = |i: usize| rate(first + i) / (self.turn * (i + 1) as f64 / biases as f64);
            0.5 * (of(0) + of(1))
        };
        (self.yaw_rate, self.pitch_rate) = (gain(0), gain(biases));
    }

    /// Its fastest [m/s].
    pub fn top_speed(&self) -> f64 {
        self.speeds[self.speeds.len() - 1][1]
    }

    /// Its beat at that [Hz].
    pub fn top_beat(&self) -> f64 {
        self.speeds[self.speeds.len() - 1][0]
    }

    /// Beats [Hz] and speeds through the water [m/s] that rise together, from none.
    pub(crate) fn speeds(&self) -> &[[f64; 2]] {
        &self.speeds
    }

    /// The share of its force with which the muscles beat: below the slowest beat that was measured it
    /// falls to nothing with the beat, as the shapes do. So a fish that hovers is straight.
    pub fn effort(&self, beat: f64) -> f64 {
        (beat / self.speeds[1][0]).clamp(0.0, 1.0)
    }

    /// How often it beats at a speed [m/s]: at most as often as at its top speed [Hz].
    pub fn beat(&self, speed: f64) -> f64 {
        let place = self.speeds.partition_point(|known| known[1] < speed).clamp(1, self.speeds.len() - 1);
        let [[slow_beat, slow], [fast_beat, fast]] = [self.speeds[place - 1], self.speeds[place]];
        let share = ((speed - slow) / (fast - slow)).clamp(0.0, 1.0);
        slow_beat + share * (fast_beat - slow_beat)
    }

    /// The fastest turn at a bias within its limit [rad/s].
    pub fn fastest_turn(&self) -> f64 {
        self.yaw_rate.abs() * self.turn
    }

    /// What its shape is like at a phase [beats] and a speed [m/s].
    pub fn moment(&self, phase: f32, speed: f32) -> Moment {
        let place =
            self.speeds.partition_point(|known| known[1] < f64::from(speed)).clamp(1, self.speeds.len() - 1);
        let [slow, fast] = [self.speeds[place - 1][1] as f32, self.speeds[place][1] as f32];
        let at = (phase - phase.floor()) * PHASES as f32;
        let (first, next) = (at as usize % PHASES, (at as usize + 1) % PHASES);
        let shape = |beat: usize, phase: usize| (beat * PHASES + phase) * self.nodes;
        Moment {
            slow: [shape(place - 1, first), shape(place - 1, next)],
            fast: [shape(place, first), shape(place, next)],
            between: at - at.floor(),
            share: ((speed - slow) / (fast - slow)).clamp(0.0, 1.0),
        }
    }

    /// Where a node is at a moment, around the fish's course at the species' own size [m].
    pub fn node(&self, node: usize, moment: &Moment) -> Vec3 {
        let shape = |[first, next]: [usize; 2]| {
            self.shapes[first + node].lerp(self.shapes[next + node], moment.between)
        };
        shape(moment.slow).lerp(shape(moment.fast), moment.share)
    }
}

/// Which shapes are mixed, and by which shares.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Where the shapes of the slower beat begin, before and after the phase; and those of the faster one.
    slow: [usize; 2],
    fast: [usize; 2],
    between: f32,
    share: f32,
}

/// The angle of (x, y) [rad], the same bytes on every machine.
fn angle_of(y: f32, x: f32) -> f32 {
    glam::Vec2::X.angle_to(glam::Vec2::new(x, y))
}
