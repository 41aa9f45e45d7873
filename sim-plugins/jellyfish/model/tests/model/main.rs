//! The model against its paper and closed forms.

mod apart;
mod bloom;
mod levels;
mod library;
mod sea;
mod slice;
mod slices;
mod species;
mod steer;
mod surface;
mod swim;
mod water;
