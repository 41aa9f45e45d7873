//! What floats in the sea, seen closely: one function a texture.

use crate::canvas::{Canvas, Random, linear, noise, smooth};

type Point = [f64; 2];

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn length(a: Point) -> f64 {
    dot(a, a).sqrt()
}

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t)
}

/// Distance from a point to a piece of a line.
fn to_piece(p: Point, a: Point, b: Point) -> f64 {
    let (along, from) = (sub(b, a), sub(p, a));
    let t = (dot(from, along) / dot(along, along).max(1e-12)).clamp(0.0, 1.0);
    length([from[0] - along[0] * t, from[1] - along[1] * t])
}

/// A grain of quartz: a polygon with broken faces, each lit differently.
pub fn sand() -> Canvas {
    let mut random = Random::new(0x5a9d);
    let mut canvas = Canvas::default();
    let sides: Vec<(Point, f64)> = (0..9).map(|_| (random.direction(), random.within(0.62, 0.86))).collect();
    let faces: Vec<(Point, f64, f64)> =
        (0..5).map(|_| (random.direction(), random.within(-0.3, 0.3), random.within(-0.16, 0.16))).collect();
    let (light, dark) = (linear(0xF6EEDB), linear(0xD2B98A));
    canvas.paint([0.0; 2], 1.0, |p| {
        let inside = sides.iter().map(|(n, d)| d - dot(p, *n)).fold(0.86 - length(p), f64::min);
        let tone: f64 = faces.iter().map(|(n, d, t)| if dot(p, *n) > *d { *t } else { -*t }).sum();
        let grain = noise(p.map(|v| v * 7.0), 11) - 0.5;
        let edge = smooth(0.0, 0.12, inside);
        (mix(dark, light, 0.55 + tone + 0.5 * grain - 0.4 * (1.0 - edge)), smooth(0.0, 0.05, inside) * 0.95)
    });
    canvas
}

/// A floc of clay: hundreds of platelets that stick together loosely.
pub fn clay() -> Canvas {
    let mut random = Random::new(0xc1a4);
    let mut canvas = Canvas::default();
    let (light, dark) = (linear(0xEFE4CF), linear(0xC4AD8A));
    for _ in 0..260 {
        let at = random.in_disc(0.8);
        let (n, size) = (random.direction(), random.within(0.04, 0.11));
        let (color, thin) = (mix(dark, light, random.unit()), random.within(0.35, 0.9));
        let alpha = random.within(0.10, 0.30);
        canvas.paint(at, size, |p| {
            let d = sub(p, at);
            let (u, v) = (dot(d, n), dot(d, [-n[1], n[0]]) / thin);
            (color, alpha * (1.0 - smooth(size * 0.7, size, (u * u + v * v).sqrt())))
        });
    }
    canvas
}

/// Phytoplankton: a chain of diatoms with golden-green bodies in clear shells, and spines.
pub fn phytoplankton() -> Canvas {
    let mut random = Random::new(0xa15e);
    let mut canvas = Canvas::default();
    let (shell, body, pale) = (linear(0xE6F0D2), linear(0xA7B24E), linear(0xDDE58F));
    let mut at = [-0.62, 0.26];
    let mut heading: Point = [0.94, -0.34];
    for _ in 0..5 {
        let radius = random.within(0.17, 0.2);
        let side = [-heading[1], heading[0]];
        for sign in [-1.0, 1.0] {
            let from = [at[0] + side[0] * radius * 0.9 * sign, at[1] + side[1] * radius * 0.9 * sign];
            let lean = random.within(-0.25, 0.25);
            let long = random.within(0.3, 0.45) * sign;
            let to = [
                from[0] + (side[0] + heading[0] * lean) * long,
                from[1] + (side[1] + heading[1] * lean) * long,
            ];
            canvas.paint(from, 0.6, |p| (shell, 0.5 * (1.0 - smooth(0.008, 0.03, to_piece(p, from, to)))));
        }
        let here = at;
        let plastids: Vec<Point> =
            (0..6).map(|_| random.in_disc(radius * 0.75)).map(|d| [here[0] + d[0], here[1] + d[1]]).collect();
        canvas.paint(here, radius + 0.05, |p| {
            let d = length(sub(p, here));
            let rim = smooth(radius * 0.72, radius * 0.95, d);
            let inside = 1.0 - smooth(radius * 0.95, radius + 0.02, d);
            (mix(pale, shell, rim), inside * (0.30 + 0.35 * rim))
        });
        for plastid in plastids {
            canvas
                .paint(plastid, 0.08, |p| (body, 0.7 * (1.0 - smooth(0.03, 0.075, length(sub(p, plastid))))));
        }
        at = [at[0] + heading[0] * radius * 1.72, at[1] + heading[1] * radius * 1.72];
        let bend = random.within(-0.2, 0.25);
        let turned = [heading[0] - heading[1] * bend, heading[1] + heading[0] * bend];
        heading = turned.map(|v| v / length(turned));
    }
    canvas
}

/// Marine snow: flakes, threads and crumbs in a fluffy lump.
pub fn detritus() -> Canvas {
    let mut random = Random::new(0xde71);
    let mut canvas = Canvas::default();
    let (light, dark) = (linear(0xF3EEE2), linear(0xBFB294));
    // The fluff that holds it together.
    canvas.paint([0.0; 2], 1.0, |p| {
        let torn = noise(p.map(|v| v * 2.6 + 5.0), 23);
        let cover = smooth(0.95, 0.1, length(p) + 0.95 * (torn - 0.5));
        (light, 0.34 * cover * smooth(0.25, 0.75, noise(p.map(|v| v * 6.0), 7)))
    });
    // Threads of slime, each a few bends long.
    for _ in 0..7 {
        let mut at = random.in_disc(0.2);
        let mut heading = random.direction();
        for _ in 0..4 {
            let to = [at[0] + heading[0] * 0.18, at[1] + heading[1] * 0.18];
            let from = at;
            canvas.paint(from, 0.3, |p| (light, 0.42 * (1.0 - smooth(0.006, 0.032, to_piece(p, from, to)))));
            at = to;
            let bend = random.within(-0.8, 0.8);
            let turned = [heading[0] - heading[1] * bend, heading[1] + heading[0] * bend];
            heading = turned.map(|v| v / length(turned));
        }
    }
    // Flakes with torn edges.
    for i in 0..11_u64 {
        let at = random.in_disc(0.52);
        let (n, size) = (random.direction(), random.within(0.1, 0.3));
        let (color, thin) = (mix(dark, light, random.within(0.2, 1.0)), random.within(0.35, 0.9));
        let alpha = random.within(0.5, 0.85);
        canvas.paint(at, size * 1.4, |p| {
            let d = sub(p, at);
            let (u, v) = (dot(d, n), dot(d, [-n[1], n[0]]) / thin);
            let torn = noise(p.map(|v| v * 6.0 + 3.0 * i as f64), 40 + i) - 0.5;
            let r = (u * u + v * v).sqrt() / size + 1.1 * torn;
            (mix(color, light, 0.5 * torn + 0.2), alpha * (1.0 - smooth(0.72, 1.0, r)))
        });
    }
    // Crumbs.
    for _ in 0..40 {
        let (at, size) = (random.in_disc(0.8), random.within(0.015, 0.05));
        let (color, alpha) = (mix(dark, light, random.unit()), random.within(0.4, 0.9));
        canvas.paint(at, size, |p| (color, alpha * (1.0 - smooth(size * 0.4, size, length(sub(p, at))))));
    }
    canvas
}

/// Plankton: a copepod, clear as glass: body, feelers, tail, a red eye.
pub fn plankton() -> Canvas {
    let mut canvas = Canvas::default();
    let (glass, rim, gut, eye) = (linear(0xDDEBEE), linear(0xF2F7F4), linear(0xD9B27C), linear(0xC2402C));
    let line = |canvas: &mut Canvas, points: &[Point], width: f64, alpha: f64| {
        for piece in points.windows(2) {
            let (a, b) = (piece[0], piece[1]);
            canvas.paint(a, length(sub(b, a)) + 0.05, |p| {
                (rim, alpha * (1.0 - smooth(width * 0.4, width, to_piece(p, a, b))))
            });
        }
    };
    for sign in [-1.0, 1.0] {
        line(
            &mut canvas,
            &[[0.0, -0.52], [0.36 * sign, -0.6], [0.68 * sign, -0.42], [0.9 * sign, -0.08]],
            0.04,
            0.65,
        );
        line(&mut canvas, &[[0.0, 0.5], [0.07 * sign, 0.66], [0.2 * sign, 0.88]], 0.045, 0.6);
        line(&mut canvas, &[[0.05 * sign, -0.2], [0.26 * sign, -0.02], [0.3 * sign, 0.1]], 0.03, 0.45);
        line(&mut canvas, &[[0.05 * sign, 0.0], [0.22 * sign, 0.18], [0.24 * sign, 0.28]], 0.03, 0.4);
    }
    canvas.paint([0.0, -0.1], 0.7, |p| {
        // A drop: round before, drawn out behind.
        let y = p[1] + 0.62;
        let half = 0.27 * (y.max(0.0) * 3.2).min(1.0).sqrt() * (1.0 - 0.62 * smooth(0.45, 1.15, y));
        let inside = half - p[0].abs();
        let body = smooth(0.0, 0.03, inside) * smooth(0.0, 0.04, y) * smooth(1.18, 1.1, y);
        let ring = 0.5 - 0.5 * smooth(0.0, 0.02, ((y * 7.0) - (y * 7.0).floor() - 0.5).abs() * 0.14);
        let edge = 1.0 - smooth(0.0, 0.09, inside);
        (mix(glass, rim, edge), body * (0.34 + 0.42 * edge + 0.12 * ring))
    });
    canvas.paint([0.0, 0.05], 0.36, |p| {
        let d = length([p[0] / 0.09, (p[1] - 0.05) / 0.32]);
        (gut, 0.55 * (1.0 - smooth(0.5, 1.0, d)))
    });
    canvas
        .paint([0.0, -0.48], 0.1, |p| (eye, 0.9 * (1.0 - smooth(0.03, 0.07, length(sub(p, [0.0, -0.48]))))));
    canvas
}

/// A cloud of specks too far away to be seen one by one.
pub fn fog() -> Canvas {
    let mut random = Random::new(0xf06);
    let mut canvas = Canvas::default();
    let color = linear(0xF1F3EE);
    // 1 in the middle, 0 with its slope at the edge: sprites that overlap show no seam.
    let fall = |p: Point| {
        let r = dot(p, p).min(1.0);
        (1.0 - r) * (1.0 - r) * (1.0 - r)
    };
    canvas.paint([0.0; 2], 1.0, |p| {
        let uneven = noise(p.map(|v| v * 2.2 + 9.0), 77);
        (color, 0.62 * fall(p) * (0.35 + 1.1 * uneven))
    });
    for _ in 0..420 {
        let at = [random.within(-1.0, 1.0), random.within(-1.0, 1.0)];
        let (size, alpha) = (random.within(0.018, 0.04), random.within(0.1, 0.5) * fall(at));
        canvas.paint(at, size, |p| (color, alpha * (1.0 - smooth(0.0, size, length(sub(p, at))))));
    }
    canvas
}
