//! Reports of benchmarks: figures by name, on standard output and in a JSON file in the target folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::json;

/// Figures by name.
pub type Figures = BTreeMap<String, f64>;

/// The folder for the files of benchmarks.
pub fn folder() -> PathBuf {
    let program = Path::new(env!("CARGO_BIN_EXE_ltm-export"));
    let folder = program.ancestors().nth(2).unwrap().join("bench");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Prints the figures, and writes them with the name of the machine to `name.json` in the [`folder`].
pub fn report(name: &str, figures: &Figures) {
    println!();
    for (key, value) in figures {
        println!("{key:40} {value:.6}");
    }
    let report = json!({"machine": machine(), "figures": figures});
    let path = folder().join(name).with_extension("json");
    fs::write(&path, serde_json::to_string_pretty(&report).unwrap() + "\n").unwrap();
    println!("\n{}", path.display());
}

fn machine() -> String {
    let cpu = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|l| l.strip_prefix("model name"));
    let model = model.map_or(std::env::consts::ARCH, |m| {
        m.trim_start_matches([' ', '\t', ':'])
    });
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores, {}", std::env::consts::OS)
}
