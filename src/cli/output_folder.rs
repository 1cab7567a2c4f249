//! Writing new folders: either complete or not at all, or file by file.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use super::output_file::temporary_beside;

const CANNOT_CREATE: &str =
    "cannot be created; does its parent folder exist, and may you write there?";

/// Calls `fill` with a temporary folder beside `path` and renames it to `path` when `fill` succeeds. `path` must not
/// exist or be an empty folder.
pub fn write_atomically(path: &Path, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let write = || -> Result<()> {
        ensure_free(path)?;
        let (builder, parent) = temporary_beside(path, 0o777);
        let folder = builder.tempdir_in(parent).context(CANNOT_CREATE)?;
        fill(folder.path())?;
        // Checked again, as filling takes a while. `remove_dir` refuses a folder that is not empty.
        ensure_free(path)?;
        if path.exists() {
            std::fs::remove_dir(path)
                .context("cannot be replaced; give the name of a new folder")?;
        }
        std::fs::rename(folder.path(), path).context("cannot be renamed")?;
        let _ = folder.keep(); // it has moved, so there is nothing to clean up
        Ok(())
    };
    write().with_context(|| path.display().to_string())
}

/// Creates the folder `path`, or takes an empty one, and calls `fill` with it. If `fill` fails, the files it wrote
/// stay: the results of hours may be among them.
pub fn write_in_place(path: &Path, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let create = || -> Result<()> {
        ensure_free(path)?;
        if !path.is_dir() {
            std::fs::create_dir(path).context(CANNOT_CREATE)?;
        }
        Ok(())
    };
    create().with_context(|| path.display().to_string())?;
    fill(path)
}

fn ensure_free(path: &Path) -> Result<()> {
    use std::io::ErrorKind;
    match std::fs::read_dir(path) {
        Ok(mut entries) => {
            let here = std::env::current_dir().and_then(std::fs::canonicalize);
            ensure!(
                path.canonicalize().ok() != here.ok(),
                "is the folder you are in; give the name of a new one"
            );
            ensure!(
                entries.next().is_none(),
                "is a folder that is not empty; give another name, or empty it first"
            );
            Ok(())
        }
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
        Err(e) if e.kind() == ErrorKind::NotADirectory => {
            bail!("is a file; give another name")
        }
        Err(e) => Err(e).context("cannot be read"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entry = |e: std::io::Result<std::fs::DirEntry>| {
            e.unwrap().file_name().to_string_lossy().into_owned()
        };
        let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(entry).collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_is_written_completely_or_not_at_all() {
        let root = tempfile::tempdir().unwrap();
        let fill = |folder: &Path| Ok(std::fs::write(folder.join("a"), "1")?);
        let path = root.path().join("new");
        let failed = write_atomically(&path, |folder| {
            fill(folder)?;
            bail!("the disk is full")
        });
        assert!(format!("{:#}", failed.unwrap_err()).contains("the disk is full"));
        assert_eq!(names(root.path()), [""; 0]);

        std::fs::create_dir(&path).unwrap();
        write_atomically(&path, fill).unwrap();
        assert_eq!(names(root.path()), ["new"]);
        assert_eq!(names(&path), ["a"]);
    }

    #[test]
    fn existing_files_and_folders_are_not_replaced() {
        let root = tempfile::tempdir().unwrap();
        let (folder, file) = (root.path().join("folder"), root.path().join("file"));
        std::fs::create_dir(&folder).unwrap();
        std::fs::write(folder.join("mine"), "keep").unwrap();
        std::fs::write(&file, "keep").unwrap();
        for (path, reason) in [(&folder, "not empty"), (&file, "is a file")] {
            let refused = write_atomically(path, |_| panic!("must not begin"));
            let message = format!("{:#}", refused.unwrap_err());
            assert!(message.contains(reason), "{message}");
        }
        assert_eq!(
            std::fs::read_to_string(folder.join("mine")).unwrap(),
            "keep"
        );
        let nowhere = root.path().join("no/where");
        let refused = write_atomically(&nowhere, |_| Ok(())).unwrap_err();
        assert!(
            format!("{refused:#}").contains("parent folder"),
            "{refused:#}"
        );
    }
}
