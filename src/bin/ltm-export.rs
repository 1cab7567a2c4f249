//! `ltm-export`: recovers, inspects and relights `.ltm` files.

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    relightable_photo::cli::main()
}

/// Cargo builds every target for wasm32 too, where there is no command line.
#[cfg(target_arch = "wasm32")]
fn main() {}
