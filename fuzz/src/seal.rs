//! Checksums made right, and heads taken apart.

use std::path::PathBuf;
use std::sync::LazyLock;

use relightable_photo::format::HEADER_BYTES;

/// Where the lengths of directory, extensions and metadata stand; each one's checksum follows it.
const LENGTHS: [usize; 3] = [104, 112, 120];
const FILE_BYTES: usize = 88;
const SCANS: usize = 100;
/// Bytes of a scan and of a chunk's entry in the directory.
const SCAN: usize = 24;
const ENTRY: usize = 12;
/// Directories that decompress to more are left alone.
const MOST_DIRECTORY: usize = 1 << 20;

fn u32_at(bytes: &[u8], at: usize) -> usize {
    let field = bytes
        .get(at..at + 4)
        .and_then(|field| field.try_into().ok());
    field.map_or(0, u32::from_le_bytes) as usize
}

fn put(bytes: &mut [u8], at: usize, value: usize) {
    bytes[at..at + 4].copy_from_slice(&(value as u32).to_le_bytes());
}

/// The directory of a file, decompressed; none if there is none.
fn directory(file: &[u8]) -> Option<Vec<u8>> {
    let end = HEADER_BYTES.checked_add(u32_at(file, LENGTHS[0]))?;
    let frame = file.get(HEADER_BYTES..end)?;
    zstd::bulk::decompress(frame, MOST_DIRECTORY).ok()
}

/// Puts another directory into a file; lengths are made to fit.
fn with_directory(file: &[u8], plain: &[u8]) -> Option<Vec<u8>> {
    let end = HEADER_BYTES + u32_at(file, LENGTHS[0]);
    let frame = zstd::bulk::compress(plain, 1).ok()?;
    let mut other = [&file[..HEADER_BYTES], &frame, &file[end..]].concat();
    let bytes = u64::from_le_bytes(file[FILE_BYTES..FILE_BYTES + 8].try_into().ok()?);
    let grown = frame.len() as i64 - (end - HEADER_BYTES) as i64;
    let bytes = bytes.wrapping_add_signed(grown);
    other[FILE_BYTES..FILE_BYTES + 8].copy_from_slice(&bytes.to_le_bytes());
    put(&mut other, LENGTHS[0], frame.len());
    Some(other)
}

/// Mutates a file: as it is, or its directory as it is before compression, which no mutation of its
/// zstd frame comes to. Returns the new length.
pub fn mutate(
    data: &mut [u8],
    size: usize,
    max_size: usize,
    seed: u32,
    mutate: fn(&mut [u8], usize, usize) -> usize,
) -> usize {
    let other = (seed % 4 == 0).then(|| {
        let file = data[..size].to_vec();
        let mut plain = directory(&file)?;
        let length = plain.len();
        // Mostly of the same length: nothing else can be right.
        plain.resize(length + 24, 0);
        let mutated = mutate(&mut plain, length, length + 24);
        plain.truncate(if seed % 32 == 0 { mutated } else { length });
        with_directory(&file, &plain)
    });
    match other.flatten() {
        Some(other) if other.len() <= max_size => {
            data[..other.len()].copy_from_slice(&other);
            other.len()
        }
        _ => mutate(data, size, max_size),
    }
}

/// A file with all checksums right, as far as its lengths make sense: what is found where checksums are
/// passed over is then found where they are not.
pub fn sealed(file: &[u8]) -> Vec<u8> {
    if file.len() < HEADER_BYTES {
        return file.to_vec();
    }
    let mut file = seal_chunks(file).unwrap_or_else(|| file.to_vec());
    let mut start = HEADER_BYTES;
    for length in LENGTHS {
        let end = (start + u32_at(&file, length)).min(file.len());
        let crc = crc32c::crc32c(&file[start..end]);
        put(&mut file, length + 4, crc as usize);
        start = end;
    }
    let crc = crc32c::crc32c(&file[..HEADER_BYTES - 4]);
    put(&mut file, HEADER_BYTES - 4, crc as usize);
    file
}

/// Checksums of the basis and of chunks, in the directory; none if it is none. A file where they are
/// right already stays as it is.
fn seal_chunks(file: &[u8]) -> Option<Vec<u8>> {
    let old = directory(file)?;
    let scans = u32_at(file, SCANS);
    let entries = old.len().checked_sub(scans.checked_mul(SCAN)?)?;
    let tiles = entries.checked_div(ENTRY * scans)?;
    if entries != scans * tiles * ENTRY {
        return None;
    }
    let (mut plain, lengths) = (old.clone(), scans * SCAN);
    let crcs = lengths + 8 * scans * tiles;
    let mut at = LENGTHS
        .iter()
        .fold(HEADER_BYTES, |at, length| at + u32_at(file, *length));
    for scan in 0..scans {
        let mut seal = |length: usize, place: usize| {
            let length = u32_at(&plain, length);
            let bytes = file.get(at..at + length).unwrap_or_default();
            if length > 0 {
                put(&mut plain, place, crc32c::crc32c(bytes) as usize);
            }
            at += length;
        };
        seal(SCAN * scan + 16, SCAN * scan + 20);
        for i in scan * tiles..(scan + 1) * tiles {
            seal(lengths + 4 * i, crcs + 4 * i);
        }
    }
    match plain == old {
        true => Some(file.to_vec()),
        false => with_directory(file, &plain),
    }
}

static KEEP: LazyLock<Option<PathBuf>> =
    LazyLock::new(|| std::env::var_os("FUZZ_FILE").map(PathBuf::from));

/// Writes the file, sealed, to where `FUZZ_FILE` says, before anything is done with it.
///
/// # Panics
/// If it cannot be written.
pub fn keep(file: &[u8]) {
    if let Some(path) = &*KEEP {
        std::fs::write(path, sealed(file)).expect("FUZZ_FILE can be written");
    }
}
