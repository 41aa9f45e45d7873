//! Plants that were modelled by hand in a modelling program: joints, and a
//! skinned mesh where there is one, from a binary glTF 2.0 file.
//!
//! What the file shows where its nodes stand is the plant at rest, relative to its root joint. Joints become
//! segments ([`rig`]), the mesh hangs on these ([`skin`], [`shape`]); a file without a mesh gets ribbons or
//! tubes along its bones. What the joints are made of comes from the species' table. Colours are the table's
//! times the mesh's own; pictures and animations in the file are not read.

mod file;
mod rig;
mod shape;
mod skin;

pub use file::{Fault, MOST_BYTES};
pub use rig::{Bone, MOST_JOINTS};
pub(crate) use shape::{FLAT, shape};
pub use skin::{Corner, MOST_TRIANGLES, MOST_VERTICES, Skin};

use crate::{
    skeleton::Segment,
    species::{JointTable, Species, Tissue},
};

/// A plant from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Its joints, parents first.
    pub bones: Vec<Bone>,
    /// Its mesh at rest.
    pub skin: Skin,
    /// The segment that moves what hangs on each bone.
    pub moving: Vec<usize>,
    /// Of which of the species' tables each bone is; None: of the stem's tissue.
    tables: Vec<Option<usize>>,
}

/// Why there is no plant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unmodelled {
    /// The file is wrong.
    File(Fault),
    /// A key of the species' table is: which, and what is wrong with it.
    Table(String, String),
}

impl From<Fault> for Unmodelled {
    fn from(fault: Fault) -> Self {
        Self::File(fault)
    }
}

/// Whether a name is what a pattern says, where `*` stands for any text.
fn matches(pattern: &str, name: &str) -> bool {
    let Some((first, rest)) = pattern.split_once('*') else { return pattern == name };
    let Some(mut name) = name.strip_prefix(first) else { return false };
    let (middle, last) = rest.rsplit_once('*').unwrap_or(("", rest));
    // What comes first of each leaves the most for those that follow.
    for part in middle.split('*') {
        let Some(at) = name.find(part) else { return false };
        name = &name[at + part.len()..];
    }
    name.ends_with(last)
}

impl Model {
    /// Reads a plant, and the segments that it has.
    ///
    /// # Errors
    /// What is wrong with the file, with its place there; or with a table of joints that names none.
    pub fn read(bytes: &[u8], species: &Species) -> Result<(Self, Vec<Segment>), Unmodelled> {
        let file = file::File::open(bytes)?;
        let number = skin::number(&file);
        let (mut bones, listed) = rig::bones(&file, number)?;
        let mut skin = match number {
            Some(number) => skin::read(&file, number, &bones, &listed)?,
            None => Skin::default(),
        };
        let mut ends = vec![0.0_f64; bones.len()];
        for corner in &skin.corners {
            let bone = &bones[corner.bones[0]];
            let end = (corner.place - bone.origin).dot(bone.up);
            ends[corner.bones[0]] = ends[corner.bones[0]].max(end);
        }
        rig::measure(&mut bones, &ends)?;
        let tables = tables(&species.joints, &bones)?;
        let tissue = |bone: usize| tissue(species, &tables, bone);
        if skin.corners.is_empty() {
            skin = shape::along(&bones, |bone| tissue(bone).0);
        }
        let (segments, moving) = rig::segments(&bones, tissue);
        Ok((Self { bones, skin, moving, tables }, segments))
    }

    /// What a bone is made of.
    fn tissue<'a>(&self, species: &'a Species, bone: usize) -> &'a Tissue {
        tissue(species, &self.tables, bone).0
    }
}

/// What a bone is made of, and the lift of the bladder on it [N].
fn tissue<'a>(species: &'a Species, tables: &[Option<usize>], bone: usize) -> (&'a Tissue, f64) {
    match tables[bone].and_then(|table| species.joints.get(table)) {
        Some(table) => (&table.tissue, table.bladder),
        None => (&species.stem.tissue, 0.0),
    }
}

/// The first table that each bone is of.
fn tables(tables: &[JointTable], bones: &[Bone]) -> Result<Vec<Option<usize>>, Unmodelled> {
    let is = |table: &JointTable, bone: &Bone| {
        (table.depth[0]..=table.depth[1]).contains(&bone.depth) && matches(&table.name, &bone.name)
    };
    if let Some(idle) = tables.iter().position(|table| !bones.iter().any(|bone| is(table, bone))) {
        let names: Vec<&str> = bones.iter().take(8).map(|bone| bone.name.as_str()).collect();
        let deepest = bones.iter().map(|bone| bone.depth).max().unwrap_or(0);
        let problem = format!(
            "is of no joint of the file, whose names are {}{} at depths of 0 to {deepest}",
            names.join(", "),
            if names.len() < bones.len() { " …" } else { "" },
        );
        return Err(Unmodelled::Table(format!("joints[{idle}]"), problem));
    }
    Ok(bones.iter().map(|bone| tables.iter().position(|table| is(table, bone))).collect())
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn a_star_stands_for_any_text() {
        for (pattern, name) in
            [("leaf", "leaf"), ("*", ""), ("leaf*", "leaf.003"), ("*.L*", "a.L.1"), ("a*b*b", "abb")]
        {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [("leaf", "leaf.1"), ("leaf*", "a leaf"), ("*.L", "a.R"), ("a*b*b", "ab")] {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
    }
}
