//! JSON objects of which some fields are changed, and all others keep their text.

use std::path::Path;

use anyhow::Result;
use serde::de::{DeserializeOwned, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::value::RawValue;

/// The fields of a JSON object in their order, with their texts.
pub struct ObjectText(Vec<(String, Box<RawValue>)>);

impl ObjectText {
    /// Reads the object of a file.
    ///
    /// # Errors
    /// If it cannot be read, or holds something else.
    pub fn read(path: &Path) -> Result<Self> {
        let json = std::fs::read_to_string(path)?;
        // Some editors write a byte order mark.
        let json = json.strip_prefix('\u{feff}').unwrap_or(&json);
        Ok(serde_json::from_str(json)?)
    }

    pub fn remove(&mut self, name: &str) {
        self.0.retain(|(field, _)| field != name);
    }

    /// Adds a field.
    pub fn push(&mut self, name: &str, value: &impl Serialize) -> Result<()> {
        let text = RawValue::from_string(serde_json::to_string(value)?)?;
        self.0.push((name.to_owned(), text));
        Ok(())
    }

    /// Replaces the value of a field by what `change` makes of it, if there is the field.
    pub fn change<T: DeserializeOwned, U: Serialize>(
        &mut self,
        name: &str,
        change: impl FnOnce(T) -> Result<U>,
    ) -> Result<()> {
        if let Some((_, text)) = self.0.iter_mut().find(|(field, _)| field == name) {
            let changed = change(serde_json::from_str(text.get())?)?;
            *text = RawValue::from_string(serde_json::to_string_pretty(&changed)?)?;
        }
        Ok(())
    }

    /// The object as the text of a file.
    pub fn pretty(&self) -> Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

impl<'de> Deserialize<'de> for ObjectText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Fields;
        impl<'de> Visitor<'de> for Fields {
            type Value = ObjectText;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ObjectText, A::Error> {
                let mut fields = Vec::new();
                while let Some(field) = map.next_entry()? {
                    fields.push(field);
                }
                Ok(ObjectText(fields))
            }
        }
        deserializer.deserialize_map(Fields)
    }
}

impl Serialize for ObjectText {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, text)| (name, text)))
    }
}
