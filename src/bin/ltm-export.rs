//! `ltm-export`: photographs in, a relightable photograph out.

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    relightable_photo::cli::main()
}

/// There is no command line in a browser; the library is what is built for one.
#[cfg(target_arch = "wasm32")]
fn main() {}
