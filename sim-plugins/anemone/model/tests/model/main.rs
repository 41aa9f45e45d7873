//! What must hold for the anemones, in one program: linking takes longer than most of it.

mod alone;
mod bed;
mod common;
mod fibre;
mod own_flow;
mod pace;
mod poses;
#[path = "../common/scene.rs"]
mod scene;
mod species_table;
mod trace;
mod waves;
