//! Extensions: blocks of data that later versions and other programs add to a file.

use super::displacement;
use super::error::{FormatError, SectionName};
use super::fields::FieldReader;
use super::memory_budget::MemoryBudget;

/// Bytes of a record before its data: tag, flags, length.
const RECORD_HEADER_BYTES: usize = 12;
/// The flag of an extension that a reader must know to read the file.
const MUST_UNDERSTAND: u32 = 1;
/// The name of the extension with the table of levels.
pub(super) const TABLE_TAG: [u8; 4] = *b"LEVL";
/// The extensions that this reader knows.
const UNDERSTOOD: &[[u8; 4]] = &[
    displacement::TAG,
    #[cfg(any(not(target_arch = "wasm32"), feature = "decoder"))]
    TABLE_TAG,
    #[cfg(any(not(target_arch = "wasm32"), feature = "decoder"))]
    super::levels::PLACE_TAG,
];

/// A named block of data. Those that this version does not know, and may ignore, are kept.
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
pub(super) fn encode<'a>(extensions: impl Iterator<Item = &'a FormatExtension>) -> Vec<u8> {
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

/// The extensions of a file.
#[derive(Debug, Default)]
pub(super) struct Extensions<'a> {
    /// The data of the displacement of the correspondence.
    pub displacement: Option<&'a [u8]>,
    /// Those that a reader may ignore.
    pub others: Vec<FormatExtension>,
}

pub(super) fn decode<'a>(
    bytes: &'a [u8],
    budget: &MemoryBudget,
) -> Result<Extensions<'a>, FormatError> {
    let damaged = |reason: &str| FormatError::DamagedSection {
        section: SectionName::Extensions,
        reason: reason.to_owned(),
    };
    let cut = || damaged("the last one is cut");
    let (mut fields, mut extensions) = (FieldReader(bytes), Extensions::default());
    while !fields.0.is_empty() {
        let header = fields.try_bytes(RECORD_HEADER_BYTES).ok_or_else(cut)?;
        let tag = [header[0], header[1], header[2], header[3]];
        let [flags, length] = FieldReader(&header[4..]).u32s();
        let must_understand = flags & MUST_UNDERSTAND != 0;
        if must_understand && !UNDERSTOOD.contains(&tag) {
            return Err(FormatError::UnknownExtension(tag));
        }
        let data = fields.try_bytes(length as usize).ok_or_else(cut)?;
        if tag == displacement::TAG {
            if extensions.displacement.replace(data).is_some() {
                return Err(damaged("there are two displacements"));
            }
            continue;
        }
        let extension = FormatExtension {
            tag,
            must_understand,
            data: budget.try_copy(data)?,
        };
        budget.try_push(&mut extensions.others, extension)?;
    }
    Ok(extensions)
}
