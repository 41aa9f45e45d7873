//! The program `reef`: everything is in the library, so that tests reach it.

fn main() -> std::process::ExitCode {
    reef::cli::main()
}
