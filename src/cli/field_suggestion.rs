//! Names of the manifest's fields that a misspelt one was probably meant to be.

/// Fields of each object of the manifest, by the object's path with `[]` for an index.
const FIELDS: [(&str, &[&str]); 6] = [
    (
        "",
        &[
            "version",
            "title",
            "creator",
            "rights",
            "light",
            "camera",
            "dark",
            "flood",
            "shots",
            "graycode",
            "correspondence",
        ],
    ),
    (
        "light",
        &["width", "height", "gamma", "response", "dimming"],
    ),
    (
        "camera",
        &[
            "width",
            "height",
            "black",
            "white",
            "response",
            "saturation",
        ],
    ),
    ("shots[]", &["pattern", "photo", "exposure"]),
    ("graycode[]", &["photo", "axis", "bit", "inverted"]),
    ("correspondence", &["affine", "displacement"]),
];
/// Letters that may be wrong, missing, too many or exchanged.
const MAX_MISTAKES: usize = 2;

/// The fields that the unknown field at `path` resembles most, such as `white` for `camera.whiet`.
pub fn similar_fields(path: &str) -> Vec<&'static str> {
    let (object, name) = split_path(path);
    let is_index = |part: &str| part.chars().all(|c| c.is_ascii_digit());
    let object = match object.split_once('.') {
        Some((list, index)) if is_index(index) => format!("{list}[]"),
        _ => object.to_owned(),
    };
    let Some((_, fields)) = FIELDS.iter().find(|(own, _)| *own == object) else {
        return Vec::new();
    };
    let mistakes = |field: &str| strsim::damerau_levenshtein(field, &name.to_lowercase());
    // Of short names, half of the letters may not be wrong.
    let is_similar =
        |field: &str| mistakes(field) <= MAX_MISTAKES.min(field.len().min(name.len()).div_ceil(3));
    let similar = fields.iter().copied().filter(|field| is_similar(field));
    let least = similar.clone().map(mistakes).min();
    similar
        .filter(|field| Some(mistakes(field)) == least)
        .collect()
}

/// The path of the object that a field is in, and the field's name.
pub fn split_path(path: &str) -> (&str, &str) {
    path.rsplit_once('.').unwrap_or(("", path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspelt_fields_have_their_names() {
        for (path, expected) in [
            ("camera.whiet", &["white"][..]),
            ("camera.withe", &["width", "white"]),
            ("shots.3.exposre", &["exposure"]),
            ("graycode.0.inversed", &["inverted"]),
            ("correspondance", &["correspondence"]),
            ("Title", &["title"]),
            ("light.gama", &["gamma"]),
            ("notes", &[]),
            ("foo", &[]),
            ("camera.lens", &[]),
            ("laboratory.white", &[]),
        ] {
            assert_eq!(similar_fields(path), expected, "{path}");
        }
    }
}
