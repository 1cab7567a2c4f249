//! What a file says about where it came from.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

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

impl Metadata {
    /// Reads the JSON of a file.
    pub(super) fn decode(json: &[u8]) -> Result<Self, serde_json::Error> {
        // Strings that are passed over would go unchecked.
        let json = str::from_utf8(json).map_err(serde::de::Error::custom)?;
        let mut json = serde_json::Deserializer::from_str(json);
        let metadata = object(&mut json)?;
        json.end()?;
        Ok(metadata)
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metadata_are_one_object_of_text() {
        let title = Metadata::decode(br#"{"title": "A", "other": ["B"]}"#)
            .unwrap()
            .title;
        assert_eq!(title, "A");
        for bad in [&b"[]"[..], b"{} {}", b"", b"{\"other\": \"\xFF\"}"] {
            assert!(Metadata::decode(bad).is_err(), "{}", bad.escape_ascii());
        }
    }
}
