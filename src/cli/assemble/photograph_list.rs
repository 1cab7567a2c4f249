//! The photographs of a session, in the order in which they were taken.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::photo_file::RAW_EXTENSIONS;

/// Extensions of pictures that are read as they are.
const PICTURE_EXTENSIONS: [&str; 4] = ["png", "tif", "tiff", "exr"];

/// The files of `paths`; of a folder its photographs, sorted by their names with numbers by their values.
pub fn photographs(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        ensure!(
            path.exists(),
            "{}: there is no such file or folder",
            path.display()
        );
        match path.is_dir() {
            true => files.extend(folder(path).with_context(|| path.display().to_string())?),
            false => files.push(path.clone()),
        }
    }
    Ok(files)
}

/// Whether a file is a PNG, TIFF or OpenEXR picture by its name.
pub fn is_picture(path: &Path) -> bool {
    has_extension(path, &PICTURE_EXTENSIONS)
}

/// Whether a file is a camera's raw file by its name.
pub fn is_raw(path: &Path) -> bool {
    has_extension(path, &RAW_EXTENSIONS)
}

/// Whether a file is a photograph that can be read, by its name.
pub fn is_photograph(path: &Path) -> bool {
    is_picture(path) || is_raw(path)
}

/// Hidden files are others: macOS keeps notes in `._IMG_1.tif`.
fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let is_hidden = |name: &OsStr| name.to_string_lossy().starts_with('.');
    if path.file_name().is_some_and(is_hidden) {
        return false;
    }
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    extension.is_some_and(|e| extensions.contains(&e.as_str()))
}

fn folder(path: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path)? {
        let file = entry?.path();
        if is_photograph(&file) && file.is_file() {
            files.push(file);
        }
    }
    ensure!(
        !files.is_empty(),
        "has no raw, PNG, TIFF or OpenEXR files (docs/shooting.md says which are read)"
    );
    // A camera that saves both writes JPEG beside raw, but converted photographs may lie beside them.
    ensure!(
        files.iter().all(|file| is_raw(file)) || files.iter().all(|file| is_picture(file)),
        "has raw files beside PNG, TIFF or OpenEXR files; move one kind out, or name the files of the other instead of the folder"
    );
    let name = |file: &PathBuf| {
        file.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    files.sort_by_cached_key(|file| (natural_key(&name(file)), name(file)));
    Ok(files)
}

/// A name divided into parts of text, each with the number after it, so that numbers are compared by their values.
fn natural_key(name: &str) -> Vec<(String, u128)> {
    let is_digit = |c: char| c.is_ascii_digit();
    let mut key = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let (text, after) = rest.split_at(rest.find(is_digit).unwrap_or(rest.len()));
        let (number, after) = after.split_at(after.find(|c| !is_digit(c)).unwrap_or(after.len()));
        key.push((text.to_owned(), number.parse().unwrap_or(0)));
        rest = after;
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_a_folder_are_sorted_by_their_numbers() {
        let folder = tempfile::TempDir::new().unwrap();
        for name in [
            "IMG_10.tif",
            "IMG_9.TIF",
            "IMG_0100.png",
            "notes.txt",
            "._IMG_9.TIF",
            "IMG_9b.tif",
        ] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let files = photographs(&[folder.path().to_owned()]).unwrap();
        let names = files
            .iter()
            .map(|file| file.file_name().unwrap().to_str().unwrap());
        let expected = ["IMG_9.TIF", "IMG_9b.tif", "IMG_10.tif", "IMG_0100.png"];
        assert_eq!(names.collect::<Vec<_>>(), expected);
        let empty = tempfile::TempDir::new().unwrap();
        assert!(photographs(&[empty.path().to_owned()]).is_err());
        let raw = folder.path().join("IMG_9.CR2");
        std::fs::write(&raw, "").unwrap();
        let error = photographs(&[folder.path().to_owned()]).unwrap_err();
        assert!(
            format!("{error:#}").contains("has raw files beside"),
            "{error:#}"
        );
        let raw = [raw];
        assert_eq!(photographs(&raw).unwrap(), raw);
        // Single files keep their order.
        let given = ["IMG_10.tif", "IMG_9.TIF"].map(|name| folder.path().join(name));
        assert_eq!(photographs(&given).unwrap(), given);
    }
}
