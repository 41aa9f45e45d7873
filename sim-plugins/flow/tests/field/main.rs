//! What must hold for the water's velocity, in one program: linking takes longer than any of it.

mod common;
mod cull;
mod directional;
mod levels;
mod singularities;
mod steepness;
mod surge;
mod waves;
