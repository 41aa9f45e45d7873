//! The program `reef`: everything but its allocator is in the library, where unit tests reach it.

use reef_bench::allocations::Counting;

/// `reef bench` counts what a step allocates; beside that it is the system's allocator.
#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn main() -> std::process::ExitCode {
    reef::cli::main()
}
