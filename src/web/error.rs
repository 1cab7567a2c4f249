//! Errors for JavaScript: a code for programs and a message for people.

use wasm_bindgen::JsValue;

use crate::format::FormatError;
use crate::relight::LightError;
use crate::relight::backend::BackendError;

/// An error that becomes a JavaScript `Error` with a property `code`.
#[derive(Debug)]
pub struct CodedError {
    /// The kind of failure, in kebab case.
    pub code: &'static str,
    /// The cause and the remedy, in English.
    pub message: String,
}

impl CodedError {
    pub(super) fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }

    /// A fault of the page's scripts, not of its input.
    pub(super) fn internal(message: &str) -> Self {
        Self::new("internal", message)
    }
}

impl From<CodedError> for JsValue {
    fn from(error: CodedError) -> Self {
        let thrown = js_sys::Error::new(&error.message);
        // Fails for frozen objects only.
        let _ = js_sys::Reflect::set(&thrown, &"code".into(), &error.code.into());
        thrown.into()
    }
}

impl From<FormatError> for CodedError {
    fn from(error: FormatError) -> Self {
        let code = match error {
            FormatError::UnknownMagic { .. } => "format-magic",
            FormatError::TextModeTransfer(_) => "format-text-mode",
            FormatError::UnsupportedVersion { .. } => "format-version",
            FormatError::ChecksumMismatch { .. } => "format-checksum",
            FormatError::Limit { .. } | FormatError::Memory { .. } => "format-limit",
            FormatError::Truncated { .. } => "format-truncated",
            _ => "format-invalid",
        };
        Self::new(code, error.to_string())
    }
}

impl From<LightError> for CodedError {
    fn from(error: LightError) -> Self {
        let code = match error {
            LightError::WrongLength { .. } | LightError::EmptyImage(_) => "light-size",
            LightError::InvalidValue(_) => "light-value",
        };
        Self::new(code, error.to_string())
    }
}

impl From<BackendError> for CodedError {
    fn from(error: BackendError) -> Self {
        let code = match error {
            BackendError::Lost(_) => "backend-lost",
            _ => "backend-unavailable",
        };
        Self::new(code, error.to_string())
    }
}
