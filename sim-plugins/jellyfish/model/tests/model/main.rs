//! The model against its paper and closed forms.

mod sea;
mod slice;
mod steer;
mod surface;
mod swim;
mod water;
