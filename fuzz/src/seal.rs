//! Checksums of mutated files, and mutations of the decompressed directory.

use std::path::PathBuf;
use std::sync::LazyLock;

use relightable_photo::format::HEADER_BYTES;

/// Offsets of the lengths of directory, extensions and metadata; a checksum follows each length.
const LENGTH_OFFSETS: [usize; 3] = [104, 112, 120];
const FILE_BYTES_OFFSET: usize = 88;
const SCANS_OFFSET: usize = 100;
/// Bytes of a scan record and of a chunk entry in the directory.
const SCAN_RECORD_BYTES: usize = 24;
const CHUNK_ENTRY_BYTES: usize = 12;
/// Maximum bytes of a decompressed directory; larger ones are not changed.
const MAX_DIRECTORY_BYTES: usize = 1 << 20;

fn u32_at(bytes: &[u8], at: usize) -> usize {
    let field = bytes
        .get(at..at + 4)
        .and_then(|field| field.try_into().ok());
    field.map_or(0, u32::from_le_bytes) as usize
}

fn put(bytes: &mut [u8], at: usize, value: usize) {
    bytes[at..at + 4].copy_from_slice(&(value as u32).to_le_bytes());
}

/// The decompressed directory of a file, or `None` if it does not decompress.
fn directory(file: &[u8]) -> Option<Vec<u8>> {
    let end = HEADER_BYTES.checked_add(u32_at(file, LENGTH_OFFSETS[0]))?;
    let frame = file.get(HEADER_BYTES..end)?;
    zstd::bulk::decompress(frame, MAX_DIRECTORY_BYTES).ok()
}

/// Replaces the directory of a file, and updates the lengths in the header.
fn with_directory(file: &[u8], content: &[u8]) -> Option<Vec<u8>> {
    let end = HEADER_BYTES + u32_at(file, LENGTH_OFFSETS[0]);
    let frame = zstd::bulk::compress(content, 1).ok()?;
    let mut other = [&file[..HEADER_BYTES], &frame, &file[end..]].concat();
    let bytes = u64::from_le_bytes(
        file[FILE_BYTES_OFFSET..FILE_BYTES_OFFSET + 8]
            .try_into()
            .ok()?,
    );
    let grown = frame.len() as i64 - (end - HEADER_BYTES) as i64;
    let bytes = bytes.wrapping_add_signed(grown);
    other[FILE_BYTES_OFFSET..FILE_BYTES_OFFSET + 8].copy_from_slice(&bytes.to_le_bytes());
    put(&mut other, LENGTH_OFFSETS[0], frame.len());
    Some(other)
}

/// Mutates the bytes of a file, or the directory before compression: a mutated zstd frame hardly ever decompresses
/// to another directory. Returns the new length.
pub fn mutate(
    data: &mut [u8],
    size: usize,
    max_size: usize,
    seed: u32,
    mutate: fn(&mut [u8], usize, usize) -> usize,
) -> usize {
    let other = (seed % 4 == 0).then(|| {
        let file = data[..size].to_vec();
        let mut content = directory(&file)?;
        let length = content.len();
        // Mostly of the same length: a directory of another length is invalid.
        content.resize(length + 24, 0);
        let mutated = mutate(&mut content, length, length + 24);
        content.truncate(if seed % 32 == 0 { mutated } else { length });
        with_directory(&file, &content)
    });
    match other.flatten() {
        Some(other) if other.len() <= max_size => {
            data[..other.len()].copy_from_slice(&other);
            other.len()
        }
        _ => mutate(data, size, max_size),
    }
}

/// A file with correct checksums, as far as its lengths are valid. So a reader that checks them finds the same
/// faults as one that ignores them.
pub fn sealed(file: &[u8]) -> Vec<u8> {
    if file.len() < HEADER_BYTES {
        return file.to_vec();
    }
    let mut file = seal_chunks(file).unwrap_or_else(|| file.to_vec());
    let mut start = HEADER_BYTES;
    for length in LENGTH_OFFSETS {
        let end = (start + u32_at(&file, length)).min(file.len());
        let crc = crc32c::crc32c(&file[start..end]);
        put(&mut file, length + 4, crc as usize);
        start = end;
    }
    let crc = crc32c::crc32c(&file[..HEADER_BYTES - 4]);
    put(&mut file, HEADER_BYTES - 4, crc as usize);
    file
}

/// Corrects the checksums in the directory; `None` if the directory is invalid. A file with correct checksums is not
/// changed.
fn seal_chunks(file: &[u8]) -> Option<Vec<u8>> {
    let old = directory(file)?;
    let scans = u32_at(file, SCANS_OFFSET);
    let entries = old
        .len()
        .checked_sub(scans.checked_mul(SCAN_RECORD_BYTES)?)?;
    let tiles = entries.checked_div(CHUNK_ENTRY_BYTES * scans)?;
    if entries != scans * tiles * CHUNK_ENTRY_BYTES {
        return None;
    }
    let (mut content, lengths) = (old.clone(), scans * SCAN_RECORD_BYTES);
    let crcs = lengths + 8 * scans * tiles;
    let mut at = LENGTH_OFFSETS
        .iter()
        .fold(HEADER_BYTES, |at, length| at + u32_at(file, *length));
    for scan in 0..scans {
        let mut seal = |length: usize, place: usize| {
            let length = u32_at(&content, length);
            let bytes = file.get(at..at + length).unwrap_or_default();
            if length > 0 {
                put(&mut content, place, crc32c::crc32c(bytes) as usize);
            }
            at += length;
        };
        seal(SCAN_RECORD_BYTES * scan + 16, SCAN_RECORD_BYTES * scan + 20);
        for i in scan * tiles..(scan + 1) * tiles {
            seal(lengths + 4 * i, crcs + 4 * i);
        }
    }
    match content == old {
        true => Some(file.to_vec()),
        false => with_directory(file, &content),
    }
}

static KEPT_FILE: LazyLock<Option<PathBuf>> =
    LazyLock::new(|| std::env::var_os("FUZZ_FILE").map(PathBuf::from));

/// Writes the file, with correct checksums, to the path in `FUZZ_FILE`, before it is read.
///
/// # Panics
/// If the file cannot be written.
pub fn keep(file: &[u8]) {
    if let Some(path) = &*KEPT_FILE {
        std::fs::write(path, sealed(file)).expect("FUZZ_FILE can be written");
    }
}
