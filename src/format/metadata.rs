//! Metadata: a JSON object about the origin of a file. It does not affect decoding.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::error::FormatError;
use super::memory_budget::MemoryBudget;
use crate::transport::{ColorMatrix, MAX_COLOR_FACTOR, is_valid_color_matrix};

/// Bytes of parsed JSON for each byte of its text, at most: an array grows to twice its length, of eight
/// bytes for every two characters.
#[cfg(not(target_arch = "wasm32"))]
const PARSED_BYTES_PER_TEXT_BYTE: u64 = 16;

/// Metadata. Readers ignore unknown fields, so that later writers may add some; writers leave out empty fields.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Metadata {
    /// Title of the picture.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Photographer.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub creator: String,
    /// Copyright and licence.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub rights: String,
    /// How the object was captured.
    #[serde(deserialize_with = "object")]
    pub capture: CaptureMetadata,
    /// Program and version that wrote the file.
    pub writer: String,
    /// Recovery method.
    pub method: String,
    /// Unit of the light transport.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub units: String,
    /// From linear RGB of the picture to linear sRGB; its primaries are those of sRGB if left out.
    /// [`MetadataText`] writes it: the serialiser's way to write numbers would be 11 kB of a WebAssembly module.
    #[serde(skip_serializing, deserialize_with = "read_color_matrix")]
    pub color_matrix: Option<ColorMatrix>,
    /// Indices of the capture's shots that the recovery used. The others can validate it.
    pub shots_used: Vec<usize>,
    /// How and from what the file was made; pages neither write nor read it.
    #[cfg(not(target_arch = "wasm32"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<serde_json::Value>,
}

/// How an object was captured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CaptureMetadata {
    /// Number of different patterns.
    pub patterns: usize,
    /// Number of photographs that the recovery used.
    pub photographs: usize,
}

/// The metadata's JSON text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MetadataText(String);

impl MetadataText {
    /// The JSON of `metadata`.
    pub(crate) fn encode(metadata: &Metadata) -> Result<Self, FormatError> {
        // Strings, numbers and JSON values never fail, and serde's messages would make the recovery module larger.
        let mut json =
            serde_json::to_string(metadata).map_err(|_| invalid("it cannot be written as JSON"))?;
        if let Some(matrix) = &metadata.color_matrix {
            let matrix = color_matrix_json(matrix);
            // Other fields follow, as some are always written.
            json.insert_str(1, &format!("\"color_matrix\":{matrix},"));
        }
        Ok(Self(json))
    }

    /// Takes the bytes of a file. In browsers the page parses the JSON: a parser here would be a tenth of the decoder.
    pub(super) fn decode(json: &[u8], budget: &MemoryBudget) -> Result<Self, FormatError> {
        // The parser does not check the strings of unknown fields.
        str::from_utf8(json).map_err(invalid)?;
        let text = String::from_utf8(budget.try_copy(json)?);
        let json = Self(text.unwrap_or_default());
        #[cfg(not(target_arch = "wasm32"))]
        {
            let _scratch = budget.scratch();
            budget.reserve(PARSED_BYTES_PER_TEXT_BYTE * json.0.len() as u64)?;
            json.read()?;
        }
        Ok(json)
    }

    /// The JSON text.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// The parsed metadata.
    ///
    /// # Errors
    /// [`FormatError::InvalidMetadata`] if the text is not JSON of the expected form. Outside browsers a
    /// reader has checked that already.
    pub fn read(&self) -> Result<Metadata, FormatError> {
        let mut json = serde_json::Deserializer::from_str(&self.0);
        let metadata = object(&mut json).map_err(invalid)?;
        json.end().map_err(invalid)?;
        Ok(metadata)
    }
}

/// The JSON of a matrix, with four decimals.
fn color_matrix_json(matrix: &ColorMatrix) -> String {
    let decimal = |factor: f64| {
        let number = (factor * 1e4).round() as i32;
        let sign = if number < 0 { "-" } else { "" };
        let [integer, decimals] = [number.abs() / 10_000, number.abs() % 10_000];
        format!("{sign}{integer}.{decimals:04}")
    };
    let rows = matrix.map(|row| format!("[{}]", row.map(decimal).join(",")));
    format!("[{}]", rows.join(","))
}

/// Reads a matrix, which cannot be null.
fn read_color_matrix<'de, D: Deserializer<'de>>(from: D) -> Result<Option<ColorMatrix>, D::Error> {
    let matrix = ColorMatrix::deserialize(from)?;
    match is_valid_color_matrix(&matrix) {
        true => Ok(Some(matrix)),
        false => Err(serde::de::Error::custom(format_args!(
            "color_matrix has a factor beyond {MAX_COLOR_FACTOR}"
        ))),
    }
}

/// The error as text, which keeps serde's type out of the WebAssembly module.
fn invalid(error: impl fmt::Display) -> FormatError {
    FormatError::InvalidMetadata(error.to_string())
}

/// Reads an object. serde takes an array too, whose fields have no names.
fn object<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<T, D::Error> {
    struct JsonObjectVisitor<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for JsonObjectVisitor<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("an object")
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
            T::deserialize(MapAccessDeserializer::new(map))
        }
    }
    from.deserialize_map(JsonObjectVisitor(PhantomData))
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;

    #[test]
    fn metadata_is_one_json_object_in_utf8() {
        let decode = |bytes: &[u8]| MetadataText::decode(bytes, &MemoryBudget::unlimited());
        let json = decode(br#"{"title": "A", "other": ["B"]}"#).unwrap();
        let title = json.read().unwrap().title;
        assert_eq!(title, "A");
        for bad in [
            &b"[]"[..],
            b"{} {}",
            b"",
            b"{\"other\": \"\xFF\"}",
            b"{\"color_matrix\": null}",
            b"{\"color_matrix\": [[1, 0], [0, 1]]}",
            b"{\"color_matrix\": [[1, 0, 0], [0, 1, 0], [0, 0, 1001]]}",
        ] {
            assert!(decode(bad).is_err(), "{}", bad.escape_ascii());
        }
        let json = decode(br#"{"color_matrix": [[1, -0.5, 0], [0, 1, 0], [0, 0, 1]]}"#).unwrap();
        let matrix = json.read().unwrap().color_matrix;
        assert_eq!(matrix.unwrap()[0], [1.0, -0.5, 0.0]);
    }
}
