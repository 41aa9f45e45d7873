//! Reef's own plugins in Rust, in one place: what is listed here is built for the tests, held to the
//! contract, and run with the scenes.

use reef_plugin::Registry;

use crate::artifacts::artifacts;

/// One of Reef's own plugins.
#[derive(Clone, Copy, Debug)]
pub struct Own {
    /// What scenes call it.
    pub id: &'static str,
    /// Its package.
    pub package: &'static str,
    /// Its library's target.
    pub library: &'static str,
    /// A module's table that gives it something to do, as JSON; None: it has something to do without.
    pub config: Option<&'static str>,
    /// Checks that find in it nothing of the kind that they look at.
    pub lacks: &'static [&'static str],
    /// Where the keys, species' keys and parameters are whose numbers have no unit: counts, shares, factors,
    /// seeds. All other numbers name one, and follow a scene's `scale` by it.
    pub pure: &'static [&'static str],
}

impl Own {
    /// Whether Reef's scenes use it; else it is an example for those who write plugins.
    pub fn is_module(&self) -> bool {
        self.id.starts_with("reef.")
    }
}

/// The modules of Reef's scenes.
pub fn modules() -> impl Iterator<Item = &'static Own> {
    OWN.iter().filter(|plugin| plugin.is_module())
}

/// Their libraries.
pub fn libraries() -> Vec<&'static str> {
    modules().map(|plugin| plugin.library).collect()
}

/// The modules of Reef's scenes, loaded, with so many workers each.
pub fn registry(workers: usize) -> Registry {
    let mut plugins = Registry::new();
    for library in libraries() {
        plugins.load(artifacts().plugin(library), workers).expect("a sound library");
    }
    plugins
}

/// All of them.
pub const OWN: &[Own] = &[
    Own {
        id: "reef.anemone",
        package: "reef-anemone",
        library: "reef_anemone",
        config: Some(
            r#"{
                "anemones": [{"species": "actinia-fragacea"}, {"species": "seagrass", "position": [0.5, 0.0, 0.2]}],
                "fibres": [{"position": [0.0, -4.0, 1.0], "count": [3, 2], "spacing": 0.1}]
            }"#,
        ),
        lacks: &[],
        pure: &[
            "anemones.scale",
            "anemones.seed",
            "fibres.count",
            "fibres.exponent",
            "fibres.nodes",
            "fibres.sides",
            "params.contact",
            "params.current",
            "params.damping",
            "params.drag",
            "params.exponent",
            "params.stiffness",
            "params.waves",
            "scatter.count",
            "scatter.grid",
            "scatter.scale",
            "scatter.seed",
            "species.foot.exponent",
            "species.foot.nodes",
            "species.foot.sides",
            "species.foot.waist",
            "species.look.foot.accent_share",
            "species.look.foot.pattern_scale",
            "species.look.foot.softness",
            "species.look.foot.tip_start",
            "species.look.foot.translucency",
            "species.look.tentacles.accent_share",
            "species.look.tentacles.pattern_scale",
            "species.look.tentacles.softness",
            "species.look.tentacles.tip_start",
            "species.look.tentacles.translucency",
            "species.tentacles.bulb",
            "species.tentacles.count",
            "species.tentacles.drag_coefficient",
            "species.tentacles.exponent",
            "species.tentacles.flatness",
            "species.tentacles.guides",
            "species.tentacles.inner_length",
            "species.tentacles.lag",
            "species.tentacles.nodes",
            "species.tentacles.sides",
            "species.tentacles.taper",
            "species.variation.length",
            "species.variation.motion",
            "species.variation.size",
            "tufts.exponent",
            "tufts.fibres",
            "tufts.guides",
            "tufts.nodes",
            "tufts.sides",
        ],
    },
    Own {
        id: "reef.fish",
        package: "reef-fish",
        library: "reef_fish",
        config: Some(
            r#"{"groups": [
                {"species": "silverside", "count": 12, "low": [-3.0, -4.0, -3.0], "high": [3.0, -1.0, 3.0]},
                {"species": "clownfish", "low": [-1.0, -4.0, -1.0], "high": [1.0, -2.0, 1.0], "homes": [[0.0, -3.5, 0.0]]}
            ]}"#,
        ),
        lacks: &["param-whole"],
        pure: &[
            "groups.count",
            "groups.scale",
            "groups.seed",
            "params.carried",
            "params.skin",
            "params.waves",
            "species.carries.reach",
            "species.look.anal.from",
            "species.look.anal.height",
            "species.look.anal.peak",
            "species.look.anal.sweep",
            "species.look.anal.to",
            "species.look.broad",
            "species.look.dorsal.from",
            "species.look.dorsal.height",
            "species.look.dorsal.peak",
            "species.look.dorsal.sweep",
            "species.look.dorsal.to",
            "species.look.eye",
            "species.look.eye_at",
            "species.look.fork",
            "species.look.gill",
            "species.look.height",
            "species.look.marks",
            "species.look.pectoral.from",
            "species.look.pectoral.height",
            "species.look.pectoral.peak",
            "species.look.pectoral.sweep",
            "species.look.pectoral.to",
            "species.look.pelvic.from",
            "species.look.pelvic.height",
            "species.look.pelvic.peak",
            "species.look.pelvic.sweep",
            "species.look.pelvic.to",
            "species.look.scales",
            "species.look.sheen",
            "species.look.snout",
            "species.look.width",
            "species.mind.alignment",
            "species.mind.apart",
            "species.mind.cohesion",
            "species.mind.cruise",
            "species.mind.home",
            "species.mind.range",
            "species.mind.separation",
            "species.mind.wander",
            "species.swim.edge",
            "species.swim.force",
            "species.swim.lag",
            "species.swim.turn",
            "species.variation",
        ],
    },
    Own {
        id: "reef.jellyfish",
        package: "reef-jellyfish",
        library: "reef_jellyfish",
        config: Some(
            r#"{
                "groups": [{"species": "comb-jelly", "count": 3, "low": [-0.5, -3.0, -0.5], "high": [0.5, -2.0, 0.5]}],
                "animals": [{"species": "moon-jelly", "position": [0.5, -3.0, 0.0], "tracers": 40}]
            }"#,
        ),
        lacks: &[],
        pure: &[
            "animals.aim",
            "animals.phase",
            "animals.scale",
            "animals.seed",
            "animals.slices",
            "animals.tracers",
            "groups.count",
            "groups.scale",
            "groups.seed",
            "groups.slices",
            "params.apart",
            "params.frequency",
            "params.grid",
            "params.idle",
            "params.jet",
            "params.skin",
            "params.steps",
            "params.strength",
            "species.arms.count",
            "species.arms.frill",
            "species.arms.frills",
            "species.bell.margin_thickness",
            "species.bell.righting",
            "species.bell.stiffness",
            "species.bell.strand_stretch",
            "species.grid.bells",
            "species.grid.cells",
            "species.look.canals",
            "species.look.gonad_count",
            "species.look.opacity",
            "species.look.streaks",
            "species.look.translucency",
            "species.motion.strength",
            "species.motion.variation",
            "species.surface.around",
            "species.surface.compression",
            "species.surface.compressions",
            "species.surface.noise",
            "species.surface.rings",
            "species.surface.structure",
            "species.surface.structures",
            "species.tentacles.count",
            "species.tentacles.variation",
        ],
    },
    Own {
        id: "reef.particles",
        package: "reef-particles",
        library: "reef_particles",
        config: Some(
            r#"{"boxes": [
                {"low": [-3.0, -4.0, -3.0], "high": [3.0, -2.0, 3.0], "count": 2000},
                {"kind": "sand", "low": [-1.0, -5.0, -1.0], "high": [1.0, -4.0, 1.0], "concentration": 50.0}
            ]}"#,
        ),
        lacks: &[],
        pure: &[
            "boxes.count",
            "boxes.grid",
            "boxes.opacity",
            "boxes.seed",
            "boxes.variation",
            "params.margin",
            "params.opacity",
            "params.size",
            "slaves",
        ],
    },
    Own {
        id: "reef.seaweed",
        package: "reef-seaweed",
        library: "reef_seaweed",
        config: Some(
            r#"{
                "plants": [{"species": "saccharina", "position": [0.4, 0.0, -0.3]}, {"species": "fucus"}],
                "beds": [{"species": ["zostera", "plocamium"], "density": 6.0, "size": [3.0, 2.0]}]
            }"#,
        ),
        lacks: &[],
        pure: &[
            "beds.scale",
            "beds.seed",
            "params.margin",
            "params.shelter",
            "params.sources",
            "params.waves",
            "plants.scale",
            "plants.seed",
            "species.blades.count",
            "species.blades.first",
            "species.blades.segments",
            "species.blades.tip_length",
            "species.blades.tissue.tip_rigidity",
            "species.forks.segments",
            "species.forks.shrink",
            "species.forks.times",
            "species.joints.depth",
            "species.joints.tissue.tip_rigidity",
            "species.look.midrib",
            "species.look.ruffle",
            "species.look.ruffles",
            "species.look.stipe",
            "species.look.teeth",
            "species.look.translucency",
            "species.stem.count",
            "species.stem.segments",
            "species.stem.tissue.tip_rigidity",
            "species.variation.age",
            "species.variation.size",
            "species.variation.stiffness",
        ],
    },
    Own {
        id: "example.kelp-rust",
        package: "reef-example-rust",
        library: "reef_example_rust",
        config: None,
        lacks: &[],
        pure: &["params.count", "params.stiffness"],
    },
];
