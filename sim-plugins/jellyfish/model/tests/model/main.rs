//! The model against its paper and closed forms.

mod slice;
mod swim;
mod water;
