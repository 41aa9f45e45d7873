//! The jellyfish plugin: a dynamic library around [`reef_jellyfish_model`].

reef_sdk::export!(reef_jellyfish_model::Jellyfish);
