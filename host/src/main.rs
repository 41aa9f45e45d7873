//! The program `reef`: everything is in the library, so that tests reach it.

use reef_bench::allocations::Counting;

/// `reef bench` counts what a step allocates; beside that it is the system's allocator.
#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn main() -> std::process::ExitCode {
    reef::cli::main()
}
