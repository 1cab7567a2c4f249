//! The GLSL for WebGL2 is translated by naga from the WGSL. After a change of the WGSL or of naga,
//! `UPDATE_SHADERS=1 cargo test --test shaders` writes it again.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::Path;

use naga::back::glsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{ShaderStage, proc::BoundsCheckPolicies};

/// Each GLSL file, its entry point, and the WGSL files it is translated from: those it needs and no others, so that the
/// translation has no unused parts.
const SHADERS: [(&str, &str, ShaderStage, &[&str]); 4] = [
    (
        "fullscreen.vert.glsl",
        "fullscreen",
        ShaderStage::Vertex,
        &["fullscreen.wgsl"],
    ),
    (
        "correlate.frag.glsl",
        "correlate",
        ShaderStage::Fragment,
        &[
            "frame_uniforms.wgsl",
            "basis_function_uniforms.wgsl",
            "correlate_fragment.wgsl",
        ],
    ),
    (
        "downsample.frag.glsl",
        "downsample",
        ShaderStage::Fragment,
        &["downsample.wgsl"],
    ),
    (
        "relight.frag.glsl",
        "relight",
        ShaderStage::Fragment,
        &["frame_uniforms.wgsl", "relight.wgsl"],
    ),
];

/// Translates one entry point to GLSL ES 3.00.
fn translate(wgsl: &str, entry_point: &str, shader_stage: ShaderStage) -> String {
    let module =
        naga::front::wgsl::parse_str(wgsl).unwrap_or_else(|e| panic!("{}", e.emit_to_string(wgsl)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string(wgsl)));
    let options = glsl::Options {
        version: glsl::Version::Embedded {
            version: 300,
            is_webgl: true,
        },
        // Without ADJUST_COORDINATE_SPACE, which flips pictures in off-screen targets. A canvas has y up in clip space
        // in both interfaces.
        writer_flags: glsl::WriterFlags::empty(),
        ..Default::default()
    };
    let pipeline = glsl::PipelineOptions {
        shader_stage,
        entry_point: entry_point.into(),
        multiview: None,
    };
    let mut glsl = String::new();
    glsl::Writer::new(
        &mut glsl,
        &module,
        &info,
        &options,
        &pipeline,
        BoundsCheckPolicies::default(),
    )
    .and_then(|mut writer| writer.write())
    .expect("naga translates the shader");
    // The version must stay the first line. Indentation would only make the WebAssembly module larger.
    let mut lines = glsl
        .lines()
        .map(str::trim_start)
        .filter(|line| !line.is_empty());
    let version = lines.next().unwrap_or_default();
    let note = "// Translated from WGSL by tests/shaders.rs; do not edit.";
    let lines = [version, note].into_iter().chain(lines);
    lines.flat_map(|line| [line, "\n"]).collect()
}

#[test]
fn checked_in_glsl_is_translated_from_the_wgsl() {
    let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/relight/shaders");
    for (name, entry_point, stage, sources) in SHADERS {
        let read = |source: &&str| std::fs::read_to_string(shaders.join(source)).unwrap();
        let wgsl: String = sources.iter().map(read).collect();
        let expected = translate(&wgsl, entry_point, stage);
        let path = shaders.join(name);
        if std::env::var_os("UPDATE_SHADERS").is_some() {
            std::fs::write(&path, &expected).unwrap();
        }
        let found = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == expected,
            "{name} is out of date; UPDATE_SHADERS=1 cargo test --test shaders writes it again"
        );
    }
}
