//! The anemone plugin: a dynamic library around [`reef_anemone_model`].

reef_sdk::export!(reef_anemone_model::Anemones);
