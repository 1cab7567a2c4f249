//! The manifest of a capture whose photographs were ingested: that of the source, with the names of the TIFFs.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

use super::object_text::ObjectText;
use crate::capture::MANIFEST_NAME;

/// The manifest of the source in the folder of its copy.
pub const SOURCE_MANIFEST: &str = "ingested-from.json";

/// `a/b.png` as `a/b.tif`.
pub fn tiff_name(name: &str) -> String {
    let stem = match name.rsplit_once('.') {
        Some((stem, extension)) if !extension.contains('/') => stem,
        _ => name,
    };
    format!("{stem}.tif")
}

/// The text of the copy's manifest, by that of the source at `path`.
///
/// # Errors
/// If it cannot be read.
pub fn ingested_manifest(path: &Path) -> Result<String> {
    let rename = || -> Result<String> {
        let mut manifest = ObjectText::read(path)?;
        for field in ["dark", "flood"] {
            manifest.change(field, |name: Option<String>| {
                Ok(name.as_deref().map(tiff_name))
            })?;
        }
        for field in ["shots", "graycode"] {
            manifest.change(field, |mut list: Vec<ObjectText>| {
                for photograph in &mut list {
                    photograph.change("photo", |name: String| Ok(tiff_name(&name)))?;
                }
                Ok(list)
            })?;
        }
        manifest.pretty()
    };
    rename().with_context(|| path.display().to_string())
}

/// Whether the manifest of the capture folder `root` is that of its source, but for the names of photographs.
pub fn is_of_source(root: &Path) -> bool {
    let source = root.join(SOURCE_MANIFEST);
    let is_of = || -> Result<bool> {
        let copy = std::fs::read_to_string(root.join(MANIFEST_NAME))?;
        let [copy, expected] = [copy, ingested_manifest(&source)?];
        let value = |text: String| serde_json::from_str::<Value>(&text);
        Ok(value(copy)? == value(expected)?)
    };
    source.exists() && is_of().unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn photographs_have_the_names_of_tiffs_and_other_fields_their_text() {
        assert_eq!(tiff_name("photos/0001.png"), "photos/0001.tif");
        assert_eq!(tiff_name("v1.2/0001"), "v1.2/0001.tif");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(SOURCE_MANIFEST);
        let shot = r#"{"pattern": "p.png", "photo": "a.png", "exposure": 0.50, "own": [1.0]}"#;
        let first = r#""version": 1, "own": 1.50, "flood": null"#;
        let json = |shot: &str| format!(r#"{{{first}, "dark": "d.png", "shots": [{shot}]}}"#);
        fs::write(&path, json(shot)).unwrap();
        let text = ingested_manifest(&path).unwrap();
        let value = |text: &str| -> Value { serde_json::from_str(text).unwrap() };
        let expected = json(shot)
            .replace("a.png", "a.tif")
            .replace("d.png", "d.tif");
        assert_eq!(value(&text), value(&expected));
        assert!(text.contains("1.50") && text.contains("0.50"), "{text}");
        // Until either is changed.
        let copy = folder.path().join(MANIFEST_NAME);
        assert!(!is_of_source(folder.path()));
        fs::write(&copy, text.replace('\n', " ")).unwrap();
        assert!(is_of_source(folder.path()));
        fs::write(&copy, text.replace("1.50", "1.60")).unwrap();
        assert!(!is_of_source(folder.path()));
    }
}
