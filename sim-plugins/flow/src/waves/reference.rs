//! The orbit once more, one centre at a time in f64 with the system's functions, straight from linear theory:
//! what the kernels are measured against. Nothing that simulates uses it.

use reef_abi as abi;

/// Displacement [m], velocity [m/s] and acceleration [m/s²] of water whose orbit has its centre at `p` [m,
/// world].
pub fn orbit(waves: &[abi::Wave], depth: f64, p: [f64; 3]) -> [[f64; 3]; 3] {
    let y = p[1].clamp(-depth, 0.0);
    let mut sum = [[0.0; 3]; 3];
    for wave in waves {
        let [r, k, omega, phase] =
            [wave.amplitude, wave.wave_number, wave.frequency, wave.phase].map(f64::from);
        let [x, z] = wave.direction.map(f64::from);
        let (s, c) = (k * (x * p[0] + z * p[2]) + phase).sin_cos();
        let [wide, high] = axes(k, depth, y).map(|axis| r * axis);
        let place = [x * wide * c, high * s, z * wide * c];
        let motion = [x * wide * s, -high * c, z * wide * s];
        for i in 0..3 {
            sum[0][i] += place[i];
            sum[1][i] += omega * motion[i];
            sum[2][i] -= omega * omega * place[i];
        }
    }
    sum
}

/// Height of the surface over (x, z) [m, world] and its slopes along x and z.
pub fn surface(waves: &[abi::Wave], [px, pz]: [f64; 2]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for wave in waves {
        let [r, k, phase] = [wave.amplitude, wave.wave_number, wave.phase].map(f64::from);
        let [x, z] = wave.direction.map(f64::from);
        let (s, c) = (k * (x * px + z * pz) + phase).sin_cos();
        sum[0] += r * s;
        sum[1] += r * k * x * c;
        sum[2] += r * k * z * c;
    }
    sum
}

/// C and S: the orbit's axes along the heading and upward, over the amplitude, at the height y (−h … 0).
pub fn axes(wave_number: f64, depth: f64, y: f64) -> [f64; 2] {
    let up = wave_number * (y + depth);
    let kh = wave_number * depth;
    if kh > 300.0 {
        // cosh and sinh would overflow; they are equal to f64's last digit except where nothing is left of
        // either.
        let e = (wave_number * y).exp();
        return [e, e];
    }
    [up.cosh() / kh.sinh(), up.sinh() / kh.sinh()]
}
