//! The seaweed plugin: a dynamic library around [`reef_seaweed_model`].

reef_sdk::export!(reef_seaweed_model::Seaweeds);
