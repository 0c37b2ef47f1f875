//! The command `runelight`; see the library of the same name.

fn main() -> std::process::ExitCode {
    runelight::main()
}
