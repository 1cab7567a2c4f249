//! Uncompressed TIFF and DNG files of known numbers.

/// The value of a tag.
pub enum TagValue<'a> {
    Bytes(&'a [u8]),
    Ascii(&'a str),
    Shorts(&'a [u16]),
    Longs(&'a [u32]),
    Rationals(&'a [[u32; 2]]),
    SignedRationals(&'a [[i32; 2]]),
}

/// A tag as it is stored.
struct EncodedTag {
    tag: u16,
    /// Type by TIFF 6.0.
    kind: u16,
    count: u32,
    bytes: Vec<u8>,
}

impl EncodedTag {
    fn new(tag: u16, value: &TagValue) -> Self {
        let (kind, count, bytes) = match value {
            TagValue::Bytes(values) => (1, values.len(), values.to_vec()),
            TagValue::Ascii(text) => (2, text.len() + 1, [text.as_bytes(), b"\0"].concat()),
            TagValue::Shorts(values) => {
                let bytes = values.iter().flat_map(|v| v.to_le_bytes());
                (3, values.len(), bytes.collect())
            }
            TagValue::Longs(values) => {
                let bytes = values.iter().flat_map(|v| v.to_le_bytes());
                (4, values.len(), bytes.collect())
            }
            TagValue::Rationals(values) => {
                let bytes = values.as_flattened().iter().flat_map(|v| v.to_le_bytes());
                (5, values.len(), bytes.collect())
            }
            TagValue::SignedRationals(values) => {
                let bytes = values.as_flattened().iter().flat_map(|v| v.to_le_bytes());
                (10, values.len(), bytes.collect())
            }
        };
        Self {
            tag,
            kind,
            count: count as u32,
            bytes,
        }
    }

    /// Bytes beside the directory: values of up to four bytes are in it.
    fn outside_bytes(&self) -> usize {
        match self.bytes.len() {
            0..=4 => 0,
            length => length.next_multiple_of(2),
        }
    }
}

/// Tag of the place of the samples.
const STRIP_OFFSETS: u16 = 273;
const STRIP_BYTE_COUNTS: u16 = 279;

/// A TIFF with these tags, and the samples in one strip at its end.
pub fn tiff_file(tags: &[(u16, TagValue)], samples: &[u8]) -> Vec<u8> {
    let given = tags.iter().map(|(tag, value)| EncodedTag::new(*tag, value));
    let mut entries: Vec<EncodedTag> = given.collect();
    let byte_count = TagValue::Longs(&[samples.len() as u32]);
    entries.push(EncodedTag::new(STRIP_BYTE_COUNTS, &byte_count));
    entries.push(EncodedTag::new(STRIP_OFFSETS, &TagValue::Longs(&[0])));
    entries.sort_by_key(|entry| entry.tag);
    let values_at = 8 + 2 + 12 * entries.len() + 4;
    let outside: usize = entries.iter().map(EncodedTag::outside_bytes).sum();
    let samples_at = (values_at + outside) as u32;
    let mut directory = (entries.len() as u16).to_le_bytes().to_vec();
    let mut values = Vec::new();
    for mut entry in entries {
        directory.extend(entry.tag.to_le_bytes());
        directory.extend(entry.kind.to_le_bytes());
        directory.extend(entry.count.to_le_bytes());
        if entry.tag == STRIP_OFFSETS {
            entry.bytes = samples_at.to_le_bytes().to_vec();
        }
        if entry.bytes.len() <= 4 {
            entry.bytes.resize(4, 0);
            directory.extend(entry.bytes);
        } else {
            directory.extend(((values_at + values.len()) as u32).to_le_bytes());
            values.extend(entry.bytes);
            values.resize(values.len().next_multiple_of(2), 0);
        }
    }
    directory.extend([0; 4]); // no other directory
    [&b"II*\0\x08\0\0\0"[..], &directory, &values, samples].concat()
}

/// Type of the samples of an RGB TIFF.
#[derive(Clone, Copy)]
pub enum RgbSamples {
    Integers { bits: u16 },
    Floats { bits: u16 },
}

/// An RGB TIFF of samples in little-endian order.
pub fn rgb_tiff(size: [u32; 2], samples: RgbSamples, bytes: &[u8]) -> Vec<u8> {
    let (format, bits) = match samples {
        RgbSamples::Integers { bits } => (1, bits),
        RgbSamples::Floats { bits } => (3, bits),
    };
    let tags = [
        (256, TagValue::Longs(&size[..1])),
        (257, TagValue::Longs(&size[1..])),
        (258, TagValue::Shorts(&[bits; 3])),
        (259, TagValue::Shorts(&[1])),
        (262, TagValue::Shorts(&[2])),
        (277, TagValue::Shorts(&[3])),
        (278, TagValue::Longs(&size[1..])),
        (284, TagValue::Shorts(&[1])),
        (339, TagValue::Shorts(&[format; 3])),
    ];
    tiff_file(&tags, bytes)
}

/// From CIE XYZ to the RGB of the sensor of [`bayer_dng`].
pub const DNG_XYZ_TO_CAMERA: [[f64; 3]; 3] = [
    [0.6722, -0.0635, -0.0963],
    [-0.4287, 1.2460, 0.2028],
    [-0.0908, 0.2162, 0.5668],
];

/// A DNG of a sensor whose 2 x 2 colours are red, green, green and blue, each with its black level. The camera was turned.
pub fn bayer_dng(size: [u32; 2], codes: &[u16], black: [u16; 4], white: u32) -> Vec<u8> {
    let matrix = DNG_XYZ_TO_CAMERA.as_flattened().iter();
    let matrix: Vec<[i32; 2]> = matrix
        .map(|factor| [(factor * 1e4).round() as i32, 10_000])
        .collect();
    let tags = [
        (254, TagValue::Longs(&[0])),
        (256, TagValue::Longs(&size[..1])),
        (257, TagValue::Longs(&size[1..])),
        (258, TagValue::Shorts(&[16])),
        (259, TagValue::Shorts(&[1])),
        (262, TagValue::Shorts(&[32_803])), // colour filter array
        (271, TagValue::Ascii("Test")),
        (272, TagValue::Ascii("Camera")),
        (274, TagValue::Shorts(&[6])), // Orientation
        (277, TagValue::Shorts(&[1])),
        (278, TagValue::Longs(&size[1..])),
        (284, TagValue::Shorts(&[1])),
        (33_421, TagValue::Shorts(&[2, 2])), // CFARepeatPatternDim
        (33_422, TagValue::Bytes(&[0, 1, 1, 2])), // CFAPattern
        (50_706, TagValue::Bytes(&[1, 4, 0, 0])), // DNGVersion
        (50_707, TagValue::Bytes(&[1, 1, 0, 0])), // DNGBackwardVersion
        (50_708, TagValue::Ascii("Test Camera")), // UniqueCameraModel
        (50_713, TagValue::Shorts(&[2, 2])), // BlackLevelRepeatDim
        (50_714, TagValue::Shorts(&black)),  // BlackLevel
        (50_717, TagValue::Longs(&[white])), // WhiteLevel
        (50_721, TagValue::SignedRationals(&matrix)), // ColorMatrix1
        (50_728, TagValue::Rationals(&[[5, 10], [1, 1], [7, 10]])), // AsShotNeutral
        (50_778, TagValue::Shorts(&[21])),   // CalibrationIlluminant1: D65
    ];
    let bytes: Vec<u8> = codes.iter().flat_map(|code| code.to_le_bytes()).collect();
    tiff_file(&tags, &bytes)
}
