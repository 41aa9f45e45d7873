//! The model against its paper and closed forms.

mod water;
