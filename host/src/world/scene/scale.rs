//! Metres from a scene's own units of length.

use super::{
    format::{FlowTable, SceneFile},
    keyed::Keyed,
};

/// The same scene with all lengths in metres. Strengths of local flow grow with the cube of the length, speeds with the
/// length, what is per length shrinks. Modules are not touched: their plugins get the scale.
pub fn in_metres(mut file: SceneFile) -> SceneFile {
    let s = file.scene.scale;
    let cube = s * s * s;
    let point = |point: [f64; 3]| point.map(|x| x * s);
    let path = |path: &Keyed<[f64; 3]>| path.map(point);
    let camera = &mut file.camera;
    camera.near *= s;
    camera.far *= s;
    camera.position = path(&camera.position);
    camera.look_at = path(&camera.look_at);
    if let Some(orbit) = &mut camera.orbit {
        orbit.center = point(orbit.center);
        orbit.radius *= s;
        orbit.height *= s;
    }
    file.water.depth *= s;
    if let Some(terrain) = &mut file.terrain {
        terrain.size = terrain.size.map(|x| x * s);
        terrain.center = terrain.center.map(|x| x * s);
        terrain.cell *= s;
        terrain.relief *= s;
        terrain.relief_length *= s;
        terrain.ripples.spacing *= s;
        terrain.ripples.height *= s;
        terrain.rocks.size = terrain.rocks.size.map(|x| x * s);
        terrain.rocks.clearing *= s;
        for rock in &mut terrain.rock {
            rock.position = rock.position.map(|x| x * s);
            rock.half_axes = rock.half_axes.map(|x| x * s);
        }
    }
    for flow in &mut file.flow {
        match flow {
            FlowTable::Source(flow) | FlowTable::Hole(flow) => {
                flow.position = path(&flow.position);
                flow.strength = flow.strength.map(|x| x * cube);
                flow.peak *= s;
                flow.core *= s;
                flow.reach *= s;
            }
            FlowTable::Whirlwind(flow) => {
                flow.position = path(&flow.position);
                flow.strength = flow.strength.map(|x| x * cube);
                flow.peak *= s;
                flow.core *= s;
                flow.reach *= s;
            }
            FlowTable::Directional(flow) => {
                flow.speed = flow.speed.map(|x| x * s);
                flow.wavelength *= s;
                flow.gradient /= s;
                flow.level *= s;
            }
            FlowTable::Shelter(flow) => {
                flow.position = path(&flow.position);
                flow.reach *= s;
            }
        }
    }
    if let Some(waves) = &mut file.waves {
        waves.wind *= s;
    }
    for wave in &mut file.wave {
        wave.amplitude *= s;
        wave.wavelength *= s;
    }
    for obstacle in &mut file.obstacle {
        obstacle.from = point(obstacle.from);
        obstacle.to = point(obstacle.to);
        obstacle.radius *= s;
        obstacle.motion = path(&obstacle.motion);
    }
    file
}
