//! What a file says about where it came from.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::FormatError;

/// Longest metadata a reader accepts: room for any caption, none for an attack.
pub(super) const MAX_METADATA_BYTES: u32 = 1 << 20;

/// JSON metadata. Unknown fields are ignored, so that later writers may add some; fields that say
/// nothing are left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Metadata {
    /// What the picture shows.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Who made the photographs.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub creator: String,
    /// Who may do what with it.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub rights: String,
    /// What the object's light transport was measured with.
    #[serde(deserialize_with = "object")]
    pub capture: CaptureNote,
    /// Program and version that wrote the file.
    pub writer: String,
    /// Recovery method.
    pub method: String,
    /// What a coefficient or element of 1 stands for.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub units: String,
    /// Indices of the capture's shots that the transport was recovered from. The others can be held
    /// against it.
    pub shots_used: Vec<usize>,
}

/// How an object was captured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CaptureNote {
    /// Different patterns that were shown.
    pub patterns: usize,
    /// Photographs that the transport was recovered from.
    pub photographs: usize,
}

/// Metadata as a file has them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MetadataJson(String);

impl MetadataJson {
    /// What is to be written of `metadata`.
    pub(super) fn of(metadata: &Metadata) -> Result<Self, FormatError> {
        let json = serde_json::to_string(metadata).map_err(wrong)?;
        Ok(Self(json))
    }

    /// Takes the bytes of a file. That they are metadata is left to who has JSON at hand in browsers, where
    /// reading it here would be a tenth of the decoder.
    pub(super) fn decode(json: &[u8]) -> Result<Self, FormatError> {
        // Strings that are passed over would go unchecked.
        let text = str::from_utf8(json).map_err(FormatError::MetadataText)?;
        let json = Self(text.to_owned());
        #[cfg(not(target_arch = "wasm32"))]
        json.read()?;
        Ok(json)
    }

    /// The JSON.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// What it says.
    ///
    /// # Errors
    /// `FormatError::Metadata` where it is not JSON of the expected form, which a reader has found out
    /// already outside browsers.
    pub fn read(&self) -> Result<Metadata, FormatError> {
        let read = || {
            let mut json = serde_json::Deserializer::from_str(&self.0);
            let metadata = object(&mut json)?;
            json.end()?;
            Ok(metadata)
        };
        read().map_err(wrong)
    }
}

/// As text, for browsers not to load what says more.
fn wrong(error: serde_json::Error) -> FormatError {
    FormatError::Metadata(error.to_string())
}

/// Reads an object. In a list, which serde takes too, fields have no names to know them by.
fn object<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D) -> Result<T, D::Error> {
    struct Object<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for Object<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("an object")
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
            T::deserialize(MapAccessDeserializer::new(map))
        }
    }
    from.deserialize_map(Object(PhantomData))
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;

    #[test]
    fn metadata_are_one_object_of_text() {
        let json = MetadataJson::decode(br#"{"title": "A", "other": ["B"]}"#).unwrap();
        let title = json.read().unwrap().title;
        assert_eq!(title, "A");
        for bad in [&b"[]"[..], b"{} {}", b"", b"{\"other\": \"\xFF\"}"] {
            assert!(MetadataJson::decode(bad).is_err(), "{}", bad.escape_ascii());
        }
    }
}
