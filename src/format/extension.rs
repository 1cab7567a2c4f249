//! Extensions: blocks of data that later versions and other programs add to a file.

use super::error::{FormatError, SectionName};
use super::fields::FieldReader;
use super::memory_budget::MemoryBudget;

/// Bytes of a record before its data: tag, flags, length.
const RECORD_HEADER_BYTES: usize = 12;
/// The flag of an extension that a reader must know to read the file.
const MUST_UNDERSTAND: u32 = 1;

/// A named block of data. This version knows none; it keeps those that a reader may ignore.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormatExtension {
    /// Its name: four ASCII characters.
    pub tag: [u8; 4],
    /// Whether a reader that does not know it has to refuse the file.
    pub must_understand: bool,
    /// Its content.
    pub data: Vec<u8>,
}

/// The records of `extensions` one after another.
pub(super) fn encode(extensions: &[FormatExtension]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for extension in extensions {
        let flags = u32::from(extension.must_understand) * MUST_UNDERSTAND;
        bytes.extend(extension.tag);
        bytes.extend(flags.to_le_bytes());
        bytes.extend((extension.data.len() as u32).to_le_bytes()); // the header's check bounds the sum
        bytes.extend(&extension.data);
    }
    bytes
}

pub(super) fn decode(
    bytes: &[u8],
    budget: &MemoryBudget,
) -> Result<Vec<FormatExtension>, FormatError> {
    let cut = || FormatError::DamagedSection {
        section: SectionName::Extensions,
        reason: "the last one is cut".to_owned(),
    };
    let (mut fields, mut extensions) = (FieldReader(bytes), Vec::new());
    while !fields.0.is_empty() {
        let header = fields.try_bytes(RECORD_HEADER_BYTES).ok_or_else(cut)?;
        let tag = [header[0], header[1], header[2], header[3]];
        let [flags, length] = FieldReader(&header[4..]).u32s();
        if flags & MUST_UNDERSTAND != 0 {
            return Err(FormatError::UnknownExtension(tag));
        }
        let data = fields.try_bytes(length as usize).ok_or_else(cut)?;
        let extension = FormatExtension {
            tag,
            must_understand: false,
            data: budget.try_copy(data)?,
        };
        budget.try_push(&mut extensions, extension)?;
    }
    Ok(extensions)
}
