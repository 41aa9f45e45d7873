//! What a later step depends on, as plain numbers.

use glam::{DVec2, DVec3};
use reef_sdk::{StateError, StateReader, StateWriter};

use super::{Bloom, within_reach};
use crate::{
    slice::{FARTHEST, Slice, SliceState},
    water::CELLS,
};

/// Everything that moves, animal by animal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BloomState {
    /// Numbers in `points`, `faces` and `trails` of each slice: animals have one, or two that follow one
    /// another.
    pub counts: Vec<u32>,
    /// Points of the slices [m].
    pub points: Vec<f64>,
    /// Faces of their water [m/s].
    pub faces: Vec<f32>,
    /// Points of the trails [m].
    pub trails: Vec<f64>,
    /// Place of the base [m], and share of the period: four numbers a slice.
    pub places: Vec<f64>,
    /// Where the windows have gone: two numbers a slice.
    pub offsets: Vec<i64>,
    /// Specks of dye [m].
    pub tracers: Vec<f64>,
    /// Where they swim, and their velocity [m/s]: six numbers an animal.
    pub ways: Vec<f64>,
    /// Cells of the grid, and flags: two numbers an animal.
    pub modes: Vec<u32>,
}

/// Flags of `modes`: it does not contract in this period; it is drawn and stepped coarsely.
const IDLES: u32 = 1;
const FAR: u32 = 2;

impl BloomState {
    /// Into the plugin's state, version 1.
    pub fn write(&self, state: &mut StateWriter) {
        self.write_with(state, self.faces.len(), |into| into.copy_from_slice(&self.faces));
    }

    /// The same, where `faces` writes so many faces.
    fn write_with(&self, state: &mut StateWriter, count: usize, faces: impl FnOnce(&mut [f32])) {
        state.put("counts", &self.counts);
        state.put("points", &self.points);
        state.fill("faces", count, faces);
        state.put("trails", &self.trails);
        state.put("places", &self.places);
        state.put("offsets", &self.offsets);
        state.put("tracers", &self.tracers);
        state.put("ways", &self.ways);
        state.put("modes", &self.modes);
    }

    /// Out of it.
    ///
    /// # Errors
    /// Something is missing or of another type.
    pub fn read(state: &mut StateReader<'_>) -> Result<Self, StateError> {
        Ok(Self {
            counts: state.get("counts")?,
            points: state.get("points")?,
            faces: state.get("faces")?,
            trails: state.get("trails")?,
            places: state.get("places")?,
            offsets: state.get("offsets")?,
            tracers: state.get("tracers")?,
            ways: state.get("ways")?,
            modes: state.get("modes")?,
        })
    }
}

/// The next `count` of some numbers.
fn take<'a, T>(from: &mut &'a [T], count: usize) -> Option<&'a [T]> {
    let (head, tail) = from.split_at_checked(count)?;
    *from = tail;
    Some(head)
}

impl Bloom {
    /// The present state.
    pub fn save(&self) -> BloomState {
        let mut state = self.save_all_but_faces();
        state.faces.resize(self.face_count(), 0.0);
        self.save_faces(&mut state.faces);
        state
    }

    /// The present state into the plugin's.
    pub fn save_to(&self, state: &mut StateWriter) {
        self.save_all_but_faces().write_with(state, self.face_count(), |into| self.save_faces(into));
    }

    fn face_count(&self) -> usize {
        self.slices().map(|slice| slice.water().face_count()).sum()
    }

    fn slices(&self) -> impl Iterator<Item = &Slice<f32>> {
        self.animals.iter().flat_map(|animal| animal.sections().map(|section| &section.slice))
    }

    /// See [`BloomState::faces`].
    fn save_faces(&self, mut into: &mut [f32]) {
        for row in self.slices().flat_map(|slice| slice.water().face_rows()) {
            let (own, rest) = into.split_at_mut(row.len());
            own.copy_from_slice(row);
            into = rest;
        }
    }

    fn save_all_but_faces(&self) -> BloomState {
        let mut state = BloomState::default();
        for animal in &self.animals {
            for section in animal.sections() {
                let slice = section.slice.save_all_but_faces();
                let faces = section.slice.water().face_count();
                let trails = section.trails.iter().flat_map(|trail| trail.points());
                let before = state.trails.len();
                state.trails.extend(trails.flat_map(|point| point.to_array()));
                let trails = state.trails.len() - before;
                state.counts.extend([slice.points.len(), faces, trails].map(|count| count as u32));
                state.points.extend(slice.points);
                state.places.extend(animal.base.to_array());
                state.places.push(slice.phase);
                state.offsets.extend(slice.offset);
            }
            state.tracers.extend(animal.tracers.iter().flat_map(|tracer| tracer.to_array()));
            state.ways.extend(animal.aim.to_array());
            state.ways.extend(animal.velocity.to_array());
            let flags = if animal.idles { IDLES } else { 0 } | if animal.far { FAR } else { 0 };
            state.modes.extend([animal.grid_cells() as u32, flags]);
        }
        state
    }

    /// Takes back what [`Bloom::save`] gave.
    ///
    /// # Errors
    /// What is wrong with it; then nothing has changed.
    pub fn load(&mut self, state: &BloomState) -> Result<(), String> {
        let mut next = self.animals.clone();
        let (mut points, mut faces, mut trails) = (&state.points[..], &state.faces[..], &state.trails[..]);
        let mut tracers = &state.tracers[..];
        let slices: usize = next.iter().map(|animal| animal.sections().count()).sum();
        let lists = [
            (state.counts.len(), 3 * slices),
            (state.places.len(), 4 * slices),
            (state.offsets.len(), 2 * slices),
            (state.ways.len(), 6 * next.len()),
            (state.modes.len(), 2 * next.len()),
        ];
        if lists.iter().any(|(length, needed)| length != needed) {
            let (animals, given) = (state.modes.len() / 2, state.counts.len() / 3);
            return Err(format!(
                "is of {animals} animals with {given} slices; here are {} with {slices}",
                next.len()
            ));
        }
        let counts = state.counts.as_chunks::<3>().0.iter();
        let mut each = counts.zip(state.places.as_chunks::<4>().0).zip(state.offsets.as_chunks::<2>().0);
        for (i, animal) in next.iter_mut().enumerate() {
            let short = || format!("has not as many numbers as animal {i} needs");
            let problem = |problem: String| format!("animal {i} {problem}");
            let [cells, flags] = [state.modes[2 * i], state.modes[2 * i + 1]];
            let [fewest, most] = CELLS;
            if !(fewest..=most).contains(&(cells as usize)) || flags > IDLES + FAR {
                return Err(format!("animal {i} has {cells} cells along a side and flags {flags}"));
            }
            animal.set_cells(cells as usize).map_err(problem)?;
            (animal.idles, animal.far) = (flags & IDLES > 0, flags & FAR > 0);
            let way = &state.ways[6 * i..6 * i + 6];
            (animal.aim, animal.velocity) = (DVec3::from_slice(way), DVec3::from_slice(&way[3..]));
            let aims = animal.aim.is_finite() && animal.aim.length_squared() > 0.0;
            if !(aims && animal.velocity.as_vec3().is_finite()) {
                return Err(format!("animal {i} has a way or a velocity that is none"));
            }
            for tracer in &mut animal.tracers {
                let place = take(&mut tracers, 2).ok_or_else(short)?;
                *tracer = DVec2::from_slice(place);
                if !tracer.is_finite() {
                    return Err(format!("animal {i} has dye at a place that is not finite"));
                }
            }
            let mut base = None;
            for (section, ((counts, place), offset)) in animal.sections_mut().zip(&mut each) {
                let [of_points, of_faces, of_trails] = counts.map(|count| count as usize);
                let slice = SliceState {
                    points: take(&mut points, of_points).ok_or_else(short)?.to_vec(),
                    faces: take(&mut faces, of_faces).ok_or_else(short)?.to_vec(),
                    offset: *offset,
                    phase: place[3],
                };
                section.slice.load(&slice).map_err(problem)?;
                let mut own = take(&mut trails, of_trails).ok_or_else(short)?;
                for trail in &mut section.trails {
                    let own = take(&mut own, 2 * trail.points().len()).ok_or_else(short)?;
                    let points: Vec<DVec2> =
                        own.as_chunks::<2>().0.iter().map(|point| DVec2::from(*point)).collect();
                    trail.set_points(&points).map_err(|problem| format!("animal {i}: {problem}"))?;
                }
                if !own.is_empty() {
                    return Err(short());
                }
                let place = DVec3::from_slice(place);
                if base.is_some_and(|base| place != base) {
                    return Err(format!("animal {i} has slices at different places"));
                }
                base = Some(place);
            }
            animal.base = base.unwrap_or_default();
            if !within_reach(animal.place()) {
                return Err(format!(
                    "animal {i} is at {}, which must be within {FARTHEST} m along each axis",
                    animal.place()
                ));
            }
            animal.emit(&self.choice);
        }
        if !(points.is_empty() && faces.is_empty() && trails.is_empty() && tracers.is_empty()) {
            return Err("has more numbers than its animals need".to_owned());
        }
        self.animals = next;
        self.gather();
        Ok(())
    }
}
