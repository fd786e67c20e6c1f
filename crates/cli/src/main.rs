//! The `steradian` command.

fn main() -> std::process::ExitCode {
    steradian_cli::main()
}
