//! Findings about the manifest and the files that it names.

use std::path::{Path, PathBuf};

use crate::capture::{CaptureError, CaptureErrorKind, CaptureFolder, PhotographRole};
use crate::cli::advice::remedy_of_capture;
use crate::cli::finding::{Finding, Severity};
use crate::cli::recover::messages;

/// Maximum number of files that a finding names.
const MAX_NAMED_FILES: usize = 12;

/// A file that cannot be read as the manifest says.
pub struct FileFault {
    pub error: CaptureError,
    /// The shot that needs it.
    pub shot: Option<usize>,
    pub severity: Severity,
}

impl FileFault {
    /// A photograph of `folder`.
    pub fn of_photograph(
        folder: &CaptureFolder,
        role: PhotographRole,
        error: CaptureError,
    ) -> Self {
        // Gray code is not read where the correspondence is declared.
        let is_needed = match role {
            PhotographRole::GrayCode(_) => folder.manifest().correspondence.is_none(),
            PhotographRole::Dark | PhotographRole::Flood | PhotographRole::Shot(_) => true,
        };
        Self {
            error,
            shot: match role {
                PhotographRole::Shot(i) => Some(i),
                _ => None,
            },
            severity: if is_needed {
                Severity::Error
            } else {
                Severity::Warning
            },
        }
    }

    /// The pattern of a shot.
    pub fn of_pattern(shot: usize, error: CaptureError) -> Self {
        Self {
            error,
            shot: Some(shot),
            severity: Severity::Error,
        }
    }

    /// The properties that faults of one finding share.
    fn key(&self) -> (Severity, &'static str, String) {
        let problem = &self.error.problem;
        (self.severity, code(problem), problem.to_string())
    }
}

/// The finding of a manifest that cannot be parsed, or of one of its fields.
pub fn manifest(error: &CaptureError) -> Finding {
    Finding::error(code(&error.problem), with_remedy(error.to_string(), error))
}

/// The findings of all fields with invalid values, and of unknown ones.
pub fn fields(folder: &CaptureFolder) -> Vec<Finding> {
    let finding = |problem: CaptureErrorKind| {
        manifest(&CaptureError {
            path: folder.manifest_path(),
            field: None,
            problem,
        })
    };
    let problems = folder.manifest().problems().into_iter().map(finding);
    problems.chain(messages::unknown_fields(folder)).collect()
}

/// One finding for all faults that are alike.
pub fn files(root: &Path, faults: &[FileFault]) -> Vec<Finding> {
    let mut groups: Vec<Vec<&FileFault>> = Vec::new();
    for fault in faults {
        match groups
            .iter_mut()
            .find(|group| group[0].key() == fault.key())
        {
            Some(group) => group.push(fault),
            None => groups.push(vec![fault]),
        }
    }
    groups
        .iter()
        .map(|group| group_finding(root, group))
        .collect()
}

fn group_finding(root: &Path, group: &[&FileFault]) -> Finding {
    let (severity, code, problem) = group[0].key();
    let error = &group[0].error;
    let message = match group.len() {
        1 => with_remedy(error.to_string(), error),
        count => {
            let names = group.iter().map(|fault| {
                let path: PathBuf = match fault.error.path.strip_prefix(root) {
                    Ok(path) => path.to_owned(),
                    Err(_) => fault.error.path.clone(),
                };
                match &fault.error.field {
                    Some(field) => format!("{} ({field})", path.display()),
                    None => path.display().to_string(),
                }
            });
            let mut listed: Vec<String> = names.take(MAX_NAMED_FILES).collect();
            if count > MAX_NAMED_FILES {
                listed.push(format!("and {} more", count - MAX_NAMED_FILES));
            }
            let text = format!(
                "{}: {count} files: {}: {problem}",
                root.display(),
                listed.join(", ")
            );
            with_remedy(text, error)
        }
    };
    let shots = group.iter().filter_map(|fault| fault.shot);
    Finding {
        severity,
        ..Finding::error(code, message)
    }
    .of_shots(shots)
}

fn with_remedy(text: String, error: &CaptureError) -> String {
    match remedy_of_capture(error) {
        Some(remedy) => format!("{text}; {remedy}"),
        None => text,
    }
}

fn code(problem: &CaptureErrorKind) -> &'static str {
    use CaptureErrorKind as Kind;
    match problem {
        Kind::NotACapture(_) | Kind::NotAManifest(_) | Kind::UnknownVersion(_) => "manifest",
        Kind::FieldType(..)
        | Kind::MissingField { .. }
        | Kind::OutOfRange { .. }
        | Kind::MissingResponse { .. }
        | Kind::ConflictingResponse
        | Kind::InvalidResponse
        | Kind::NoShots
        | Kind::NotInvertible
        | Kind::DisplacementOfOtherPicture => "manifest-field",
        Kind::Missing => "file-missing",
        Kind::Io(_) | Kind::Unreadable(..) | Kind::WrongChecksum(_) | Kind::InvalidTruth(_) => {
            "file-unreadable"
        }
        Kind::WrongExtent { .. } => "file-size",
        Kind::PhotoType(_)
        | Kind::PatternType(_)
        | Kind::Interlaced
        | Kind::Planar
        | Kind::LargeStrips(_) => "file-type",
        Kind::MissingGrayCode { .. } => "gray-code-incomplete",
    }
}
