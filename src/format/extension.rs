//! What later versions and other programs add to a file.

use super::FormatError;
use super::error::Part;

/// Bytes before an extension's data: tag, flags, length.
const HEAD: usize = 12;
/// The flag of what a reader must not pass over.
const MUST_UNDERSTAND: u32 = 1;

/// A named block of data. This reader knows none; it keeps those that it may pass over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Extension {
    /// Its name: four characters of ASCII.
    pub tag: [u8; 4],
    /// Whether a reader that does not know it has to refuse the file.
    pub must_understand: bool,
    /// Its content.
    pub data: Vec<u8>,
}

/// As in a file.
pub(super) fn encode(extensions: &[Extension]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for extension in extensions {
        let flags = u32::from(extension.must_understand) * MUST_UNDERSTAND;
        bytes.extend(extension.tag);
        bytes.extend(flags.to_le_bytes());
        bytes.extend((extension.data.len() as u32).to_le_bytes()); // the writer bounds the whole
        bytes.extend(&extension.data);
    }
    bytes
}

/// Reads extensions; an error if there is one that has to be understood.
pub(super) fn decode(mut bytes: &[u8]) -> Result<Vec<Extension>, FormatError> {
    let cut = || FormatError::Decompress {
        part: Part::Extensions,
        reason: "they end within one".to_owned(),
    };
    let mut extensions = Vec::new();
    while !bytes.is_empty() {
        let (&[a, b, c, d, f0, f1, f2, f3, l0, l1, l2, l3], rest) =
            bytes.split_first_chunk::<HEAD>().ok_or_else(cut)?;
        let (tag, flags) = ([a, b, c, d], u32::from_le_bytes([f0, f1, f2, f3]));
        if flags & MUST_UNDERSTAND != 0 {
            return Err(FormatError::Extension { tag });
        }
        let length = u32::from_le_bytes([l0, l1, l2, l3]) as usize;
        let (data, rest) = rest.split_at_checked(length).ok_or_else(cut)?;
        extensions.push(Extension {
            tag,
            must_understand: false,
            data: data.to_vec(),
        });
        bytes = rest;
    }
    Ok(extensions)
}
