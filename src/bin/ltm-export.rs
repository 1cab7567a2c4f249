//! `ltm-export`: photographs in, a relightable photograph out.

fn main() -> std::process::ExitCode {
    std::process::ExitCode::SUCCESS
}
