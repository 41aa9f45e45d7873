//! The fish plugin: a dynamic library around [`reef_fish_model`].

reef_sdk::export!(reef_fish_model::Fish);
