//! What must hold of the model, by properties and closed forms.

#[path = "../common/mod.rs"]
mod common;

mod bed;
mod contact;
mod draw;
mod equations;
mod flows;
mod levels;
mod modelled;
mod motion;
mod sow;
mod species_table;
