//! The command-line program of symbolt. It only calls the library.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
