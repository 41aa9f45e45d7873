//! The particle plugin: a dynamic library around [`reef_particles_model`].

reef_sdk::export!(reef_particles_model::Particles);
