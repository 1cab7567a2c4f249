//! The GLSL for WebGL2 is what naga makes of the WGSL. `UPDATE_SHADERS=1 cargo test --test shaders`
//! rewrites it after a change of the WGSL or of naga.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::Path;

use naga::back::glsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{ShaderStage, proc::BoundsCheckPolicies};

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
        // Not ADJUST_COORDINATE_SPACE: it turns the picture upside down for off-screen targets,
        // and a canvas has y up in clip space under both interfaces.
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
    // The version has to stay the first line. Indentation would only make the module larger.
    let mut lines = glsl
        .lines()
        .map(str::trim_start)
        .filter(|line| !line.is_empty());
    let version = lines.next().unwrap_or_default();
    let note = "// naga made this of relight.wgsl: change that one.";
    let lines = [version, note].into_iter().chain(lines);
    lines.flat_map(|line| [line, "\n"]).collect()
}

#[test]
fn checked_in_glsl_is_translated_from_the_wgsl() {
    let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/relight/shaders");
    let wgsl = std::fs::read_to_string(shaders.join("relight.wgsl")).unwrap();
    for (name, entry_point, stage) in [
        ("relight.vert.glsl", "cover", ShaderStage::Vertex),
        ("see.frag.glsl", "see", ShaderStage::Fragment),
        ("across.frag.glsl", "across", ShaderStage::Fragment),
        ("down.frag.glsl", "down", ShaderStage::Fragment),
        ("relight.frag.glsl", "relight", ShaderStage::Fragment),
    ] {
        let expected = translate(&wgsl, entry_point, stage);
        let path = shaders.join(name);
        if std::env::var_os("UPDATE_SHADERS").is_some() {
            std::fs::write(&path, &expected).unwrap();
        }
        let found = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == expected,
            "{name} is not what naga makes of relight.wgsl; UPDATE_SHADERS=1 cargo test --test \
             shaders rewrites it"
        );
    }
}
