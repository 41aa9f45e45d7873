//! The passes of a frame, one file each, in the order in which a frame runs them.
