use super::*;

/// A strip of two quads along y on three joints, with a coarser level of one quad.
pub(crate) struct Strip {
    pub(crate) vertices: Vec<abi::MeshVertex>,
    pub(crate) indices: Vec<u32>,
    pub(crate) levels: Vec<abi::MeshLevel>,
    pub(crate) rest: Vec<abi::Joint>,
    pub(crate) joints: Vec<u32>,
    pub(crate) weights: Vec<f32>,
}

impl Strip {
    pub(crate) fn new() -> Self {
        let vertex = |x: f32, y: f32| abi::MeshVertex {
            position: [x, y, 0.0],
            uv: [x, y],
            color: u32::MAX,
            ..Default::default()
        };
        // The four corners of the whole come first: the coarser level has these alone.
        let places = [[0.0, 0.0], [1.0, 0.0], [0.0, 2.0], [1.0, 2.0], [0.0, 1.0], [1.0, 1.0]];
        let quad = |a: u32, b: u32, c: u32, d: u32| [a, b, d, a, d, c];
        let level = |first_index, index_count, vertex_count, error, influences| abi::MeshLevel {
            first_index,
            index_count,
            vertex_count,
            error,
            influences,
            ..Default::default()
        };
        let joint = |y| abi::Joint { rotation: [0.0, 0.0, 0.0, 1.0], translation: [0.0, y, 0.0], scale: 1.0 };
        Self {
            vertices: places.map(|[x, y]| vertex(x, y)).to_vec(),
            indices: [quad(0, 1, 4, 5), quad(4, 5, 2, 3), quad(0, 1, 2, 3)].concat(),
            levels: vec![level(0, 12, 6, 0.0, 2), level(12, 6, 4, 0.1, 1)],
            rest: [0.0, 1.0, 2.0].map(joint).to_vec(),
            joints: [[0, 1], [0, 1], [2, 1], [2, 1], [1, 2], [1, 0]].concat(),
            weights: [[1.0, 0.0], [0.25, 0.75], [1.0, 0.0], [0.9, 0.1], [0.5, 0.5], [1.0, 0.0]].concat(),
        }
    }

    pub(crate) fn wanted(&self) -> Wanted<'_> {
        Wanted {
            name: "strip",
            vertices: &self.vertices,
            indices: &self.indices,
            levels: &self.levels,
            rest: &self.rest,
            influences: 2,
            joints: &self.joints,
            weights: &self.weights,
            flags: 0,
        }
    }
}

fn verdict(spoil: impl FnOnce(&mut Strip)) -> String {
    let mut strip = Strip::new();
    spoil(&mut strip);
    Meshes::default().add(strip.wanted()).expect_err("the spoilt mesh passed")
}

#[test]
fn bones_are_sorted_by_weight_and_sum_to_a_whole() {
    let mut meshes = Meshes::default();
    assert_eq!(meshes.add(Strip::new().wanted()), Ok(Ok(1)));
    let mesh = &meshes.list()[0];
    for own in mesh.bones.chunks_exact(2) {
        assert_eq!((own[0] >> 16) + (own[1] >> 16), WHOLE);
        assert!(own[0] >> 16 >= own[1] >> 16);
    }
    assert_eq!(mesh.bones[2] & 0xffff, 1, "vertex 1 hangs on joint 1 most");
    // Joint 0 moves vertices 0 and 1; the weight of vertex 5 for it is none.
    assert_eq!(mesh.reach[0], 1.0);
    assert_eq!(mesh.reach[1], 2.0_f32.sqrt());
    assert_eq!(mesh.bounds, [0.5, 1.0, 0.0, (0.25_f32 + 1.0).sqrt()]);
    assert!(mesh.opaque);
}

#[test]
fn what_is_made_again_has_the_same_id_and_what_differs_another() {
    let mut meshes = Meshes::default();
    let mut make = |spoil: &dyn Fn(&mut Strip), name: &str| {
        let mut strip = Strip::new();
        spoil(&mut strip);
        let wanted = Wanted { name, ..strip.wanted() };
        meshes.add(wanted).expect("a mesh").expect("room")
    };
    assert_eq!(make(&|_| {}, "strip"), 1);
    assert_eq!(make(&|_| {}, "strip"), 1);
    assert_eq!(make(&|_| {}, "other"), 2);
    let changes: [&dyn Fn(&mut Strip); 6] = [
        &|s| s.vertices[3].thickness = 0.01,
        &|s| s.indices.swap(0, 2),
        &|s| s.levels[1].error = 0.2,
        &|s| s.rest[0].scale = 2.0,
        &|s| s.joints[1] = 2,
        &|s| s.weights.copy_from_slice(&[0.5; 12]),
    ];
    for (i, change) in changes.iter().enumerate() {
        assert_eq!(make(change, "strip"), 3 + i as u32);
    }
}

#[test]
fn a_message_names_the_place_the_value_and_what_is_allowed() {
    assert_eq!(
        verdict(|s| s.vertices[3].position[1] = f32::NAN),
        "vertex 3: position is NaN, allowed is -100000 to 100000"
    );
    assert_eq!(verdict(|s| s.indices[7] = 6), "index 7 is 6, there are 6 vertices");
    assert_eq!(verdict(|s| s.indices[13] = 5), "level 1: its index 1 is vertex 5, its vertices are 0 to 3");
    assert_eq!(verdict(|s| s.levels[1].index_count = 9), "level 1: its indices end at 21, there are 18");
    assert_eq!(verdict(|s| s.levels[0].index_count = 4), "level 0: index_count is 4, allowed is 3, 6, 9 …");
    assert_eq!(
        verdict(|s| s.levels[1].error = 0.0),
        "level 1: error is 0, allowed is above 0: levels grow coarser"
    );
    assert_eq!(
        verdict(|s| s.levels[1].influences = 4),
        "level 1: influences is 4, allowed is 0, 1, 2, 4 or 8 up to 2"
    );
    assert_eq!(
        verdict(|s| s.rest[2].rotation[3] = f32::NAN),
        "rest of joint 2: rotation is (0, 0, 0, NaN), which is no unit quaternion"
    );
    assert_eq!(verdict(|s| s.joints[5] = 3), "vertex 2 hangs on joint 3, there are 3");
    assert_eq!(
        verdict(|s| s.weights[2] = 0.5),
        "the weights of vertex 1 sum to 1.25, allowed is 1 within 0.001"
    );
    assert_eq!(verdict(|s| s.weights[0] = -1.0), "a weight of vertex 0 is -1, allowed is 0 to 1");
}

#[test]
fn a_mesh_that_cannot_be_is_refused_before_it_is_read() {
    let good = Sizes { vertices: 6, indices: 18, levels: 2, joints: 3, influences: 2 };
    assert_eq!(good.check(), Ok(()));
    let refused = |sizes: Sizes| sizes.check().expect_err("refused");
    assert_eq!(
        refused(Sizes { vertices: 1_000_000_000, ..good }),
        "vertex_count is 1000000000, allowed is 1 to 1048576"
    );
    assert_eq!(refused(Sizes { influences: 3, ..good }), "influences is 3, allowed is 0, 1, 2, 4 or 8");
    assert_eq!(refused(Sizes { joints: 0, ..good }), "influences is 2, and there are no joints");
    assert_eq!(refused(Sizes { levels: 0, ..good }), "level_count is 0, allowed is 1 to 8");
}

#[test]
fn all_meshes_together_have_a_limit_that_its_error_names() {
    let many = vec![abi::MeshVertex { color: u32::MAX, ..Default::default() }; MOST_VERTICES as usize];
    let strip = Strip::new();
    let mut meshes = Meshes::default();
    for i in 0..5 {
        let level = [abi::MeshLevel {
            index_count: 3,
            vertex_count: 6,
            error: 0.0,
            first_index: 3 * i,
            ..Default::default()
        }];
        let plain =
            Wanted { influences: 0, rest: &[], joints: &[], weights: &[], levels: &level, ..strip.wanted() };
        let made = meshes.add(Wanted { vertices: &many, ..plain }).expect("it can be");
        match i {
            4 => assert!(made.expect_err("too many").contains("4194304 at most")),
            _ => assert_eq!(made, Ok(i + 1)),
        }
    }
    assert!(meshes.refused.too_many.is_some());
}

#[test]
fn the_indices_of_all_meshes_have_a_limit_too() {
    let indices = [0, 1, 2].repeat(MOST_INDICES as usize / 3);
    let strip = Strip::new();
    let mut meshes = Meshes::default();
    let made: Vec<_> = (0..5)
        .map(|i| {
            let level =
                [abi::MeshLevel { index_count: 3, vertex_count: 6, first_index: 3 * i, ..strip.levels[0] }];
            meshes.add(Wanted { indices: &indices, levels: &level, ..strip.wanted() }).expect("it can be")
        })
        .collect();
    assert_eq!(made[..4], [1, 2, 3, 4].map(Ok));
    assert!(made[4].as_ref().expect_err("too many").contains("indices beside"), "{:?}", made[4]);
}
