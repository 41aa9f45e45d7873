//! Textures that a plugin makes: they go with the outputs that name them, keep their ids over a load and a
//! reset, and end with their instance.

use std::sync::Arc;

use reef_plugin::{Library, Plugin as Loaded, StepStatus};
use reef_sdk::prelude::*;
use reef_streams::Outputs;
use reef_tests::sea::{Sea, config};

/// Two textures from the start; from step 3 on a third in place of the second.
struct Painter {
    host: Host,
    step: u64,
    first: Texture,
    second: Option<Texture>,
    third: Option<Texture>,
}

#[derive(serde::Deserialize, schemars::JsonSchema)]
struct Size {
    /// Texels along a side.
    side: u32,
}

fn paint(host: &Host, name: &str, side: u32, shade: u8) -> Result<Texture, TextureError> {
    let texels = vec![shade; side as usize * side as usize * 4];
    host.texture(name, TextureFormat::Srgb, [side; 2], &texels)
}

impl Plugin for Painter {
    const ID: &'static str = "test.painter";
    const NAME: &'static str = "Painter";
    const VERSION: &'static str = "1.0.0";
    const VENDOR: &'static str = "Reef's tests";
    const DESCRIPTION: &'static str = "Makes textures.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Size;

    fn create(host: &Host, _: &SceneInfo, config: Size) -> Result<Self, ConfigError> {
        let first = paint(host, "first", config.side, 10)?;
        let second = Some(paint(host, "second", config.side, 20)?);
        Ok(Self { host: *host, step: 0, first, second, third: None })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        self.step += u64::from(input.dt() > 0.0);
        if self.step == 3 && self.third.is_none() {
            self.third = Some(paint(&self.host, "third", 2, 30)?);
            self.second = None;
        }
        let sprite = |texture: &Texture| abi::Billboard {
            size: 0.1,
            texture: texture.id(),
            flags: abi::BILLBOARD_FACING,
            ..Default::default()
        };
        let made = [Some(&self.first), self.second.as_ref(), self.third.as_ref()];
        let sprites: Vec<abi::Billboard> = made.into_iter().flatten().map(sprite).collect();
        output.emit(&[abi::Object { id: 1, ..Default::default() }])?;
        output.emit(&sprites)?;
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        state.put("step", &[self.step]);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        self.step = state.get::<u64>("step")?[0];
        Ok(())
    }
}

fn plugin() -> Loaded {
    Library::from_entry(reef_sdk::entry::<Painter>(), 2).unwrap().1.remove(0)
}

fn names(outputs: &Outputs) -> Vec<&str> {
    outputs.textures.iter().map(|texture| texture.name.as_str()).collect()
}

fn ids(outputs: &Outputs) -> Vec<u32> {
    outputs.billboards.iter().map(|sprite| sprite.texture).collect()
}

#[test]
fn each_steps_outputs_carry_the_textures_that_there_are_and_older_ones_keep_theirs() {
    let sea = Sea::default();
    let mut instance = plugin().create(&config(r#"{"side": 4}"#)).unwrap();
    let mut seen: Vec<Arc<Outputs>> = Vec::new();
    for step in 0..5 {
        assert_eq!(instance.step(&sea.input(step), &[]).status, StepStatus::Ok);
        seen.push(instance.outputs().clone());
    }
    assert!(Arc::ptr_eq(&seen[0].textures, &seen[2].textures), "nothing is copied from step to step");
    assert_eq!((names(&seen[2]), ids(&seen[2])), (vec!["first", "second"], vec![1, 2]));
    assert_eq!((names(&seen[3]), ids(&seen[3])), (vec!["first", "third"], vec![1, 3]));
    let second = seen[2].textures[1].clone();
    assert_eq!((second.width, second.height, second.srgb, second.texels.len()), (4, 4, true, 64));
    drop(instance);
    assert_eq!(names(&seen[4]), ["first", "third"], "a picture of the past can still be drawn");
    drop(seen);
    assert_eq!(Arc::strong_count(&second), 1, "nobody else holds what the instance made");
}

#[test]
fn a_loaded_state_and_a_reset_keep_the_ids_and_hold_no_more_textures_than_before() {
    let sea = Sea::default();
    let mut instance = plugin().create(&config(r#"{"side": 2}"#)).unwrap();
    instance.step(&sea.input(0), &[]);
    let before = instance.outputs().clone();
    let state = instance.save().unwrap();
    // More often than there is room for, were each time's kept.
    for _ in 0..100 {
        instance.load(&state).unwrap();
        instance.reset().unwrap();
    }
    instance.step(&sea.input(0), &[]);
    assert_eq!(ids(instance.outputs()), ids(&before));
    assert_eq!(names(instance.outputs()), names(&before));
}

#[test]
fn instances_have_textures_of_their_own() {
    let sea = Sea::default();
    let plugin = plugin();
    let [mut a, mut b] =
        ["4", "8"].map(|side| plugin.create(&config(&format!("{{\"side\": {side}}}"))).unwrap());
    for instance in [&mut a, &mut b] {
        instance.step(&sea.input(0), &[]);
    }
    assert_eq!(ids(a.outputs()), ids(b.outputs()));
    assert_eq!([a, b].map(|instance| instance.outputs().textures[0].width), [4, 8]);
}

#[test]
fn what_the_host_refuses_is_said_in_its_words() {
    let error = plugin().create(&config(r#"{"side": 2000}"#)).unwrap_err().to_string();
    assert!(error.contains("texture_create: `first`: 2000 x 2000 texels, allowed is 1 to 1024"), "{error}");
}
