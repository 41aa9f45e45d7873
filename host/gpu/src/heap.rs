//! The heap under a driver that draws on the processor.

/// Makes the heap keep what is freed. A software rasteriser allocates its vertices and bins anew in each
/// draw, in pieces so great that the C library would fetch them from the system and give them back every
/// time: half of the time of a picture of many vertices is then spent in page faults.
pub(crate) fn keep() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// The greatest that glibc takes for a piece of its own mapping [bytes].
        const MAPPED_FROM: libc::c_int = 32 << 20;
        /// Free memory at the heap's end that is kept [bytes].
        const KEPT: libc::c_int = 1 << 30;
        // SAFETY: `mallopt` may be called at any time; these change when memory is given back, nothing else.
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED_FROM);
            libc::mallopt(libc::M_TRIM_THRESHOLD, KEPT);
        }
    }
}
