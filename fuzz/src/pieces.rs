//! Reading a file in pieces.

use relightable_photo::format::{ChunkSelection, FileIndex, LtmReader};
use relightable_photo::transport::Decibels;

use crate::choices::Choices;
use crate::reading::{self, LIMITS, Read, check_transport};

/// Feeds a file to a reader as a browser may: ranges that the reader wants, in any order, in pieces of any size, some
/// of them twice. Returns the result when no wanted byte is left in the file.
///
/// # Panics
/// If the reader wants bytes that it has, or still wants bytes at the end.
pub fn read(file: &[u8], choices: &mut Choices<'_>) -> Read {
    let mut reader = LtmReader::new(LIMITS);
    let mut failed = None;
    // Each iteration feeds at least one new byte.
    for _ in 0..=2 * file.len() {
        let selection = match choices.chance(64) && reader.index().is_some() {
            true => ChunkSelection {
                viewport: Some((0..choices.byte().into(), 0..choices.byte().into())),
                snr: choices.chance(128).then(|| Decibels(choices.byte().into())),
            },
            false => ChunkSelection::default(),
        };
        let wanted_in_file = |reader: &LtmReader, selection: &ChunkSelection| -> Vec<_> {
            let wanted = reader.wants(selection).into_iter();
            wanted
                .filter(|range| range.start < file.len() as u64)
                .collect()
        };
        let mut ranges = wanted_in_file(&reader, &selection);
        if ranges.is_empty() {
            ranges = wanted_in_file(&reader, &ChunkSelection::default());
        }
        if ranges.is_empty() {
            break;
        }
        let range = &ranges[usize::from(choices.u16()) % ranges.len()];
        let (start, end) = (range.start as usize, (range.end as usize).min(file.len()));
        let mut range = start..end;
        if choices.chance(160)
            && let Some(chunk) = chunk_within(reader.index(), &range, choices)
        {
            range = chunk;
        }
        let length = match choices.byte() {
            0 => range.len(),
            length => range.len().min(usize::from(length) * 2),
        };
        range.end = range.start + length;
        let before = reader.progress().bytes;
        if choices.chance(32) {
            // Also some of the bytes that the reader already has before the range.
            let wanted = reader.wants(&ChunkSelection::default());
            let ends = wanted.iter().map(|range| range.end as usize);
            let known = ends.filter(|end| *end <= range.start).max().unwrap_or(0);
            if wanted
                .iter()
                .any(|wanted| wanted.start == range.start as u64)
            {
                let before = range.start - known;
                range.start -= before.min(choices.byte().into());
            }
        }
        match reader.feed(range.start as u64, &file[range]) {
            Ok(()) => assert!(reader.progress().bytes > before, "a wanted byte is not new"),
            Err(error) => {
                failed = Some(error);
                break;
            }
        }
    }
    let Some(error) = failed else {
        assert!(
            reader
                .wants(&ChunkSelection::default())
                .iter()
                .all(|range| range.start >= file.len() as u64),
            "the reader wants more of a file that it has"
        );
        return reader.finish();
    };
    // After an error no call panics.
    let mut at = usize::from(choices.u16()) % file.len().max(1);
    while at < file.len() {
        let end = file.len().min(at + 1 + usize::from(choices.u16()));
        let _ = reader.feed(at as u64, &file[at..end]);
        at = end;
    }
    let _ = reader.wants(&ChunkSelection::default());
    if let Ok((transport, _)) = reader.finish_early() {
        check_transport(&transport);
    }
    Err(error)
}

/// A chunk within a range of bytes.
fn chunk_within(
    index: Option<&FileIndex>,
    range: &std::ops::Range<usize>,
    choices: &mut Choices<'_>,
) -> Option<std::ops::Range<usize>> {
    let index = index?;
    let ranges = index.chunks().map(|chunk| index.range(chunk));
    let ranges = ranges.map(|chunk| chunk.start as usize..chunk.end as usize);
    let inside = ranges.filter(|chunk| chunk.start >= range.start && chunk.end <= range.end);
    let inside: Vec<_> = inside.collect();
    let at = usize::from(choices.u16()).checked_rem(inside.len())?;
    inside.get(at).cloned()
}

/// Reads a file in pieces and whole.
///
/// # Panics
/// If the results differ.
pub fn check(file: &[u8], choices: &mut Choices<'_>) {
    // Without bytes after the end, which a reader never wants, and refuses in a whole file.
    let end = reading::index(file).map(|index| index.header.file_bytes);
    let end = end.and_then(|end| usize::try_from(end).ok());
    let file = &file[..end.unwrap_or(file.len()).min(file.len())];
    match (read(file, choices), reading::whole(file)) {
        (Ok(pieces), Ok(whole)) => assert!(
            pieces == whole,
            "the pieces give another transport than the whole file"
        ),
        (Err(_), Err(_)) => {}
        (Ok(_), Err(error)) => panic!("the file is read in pieces, but refused whole: {error}"),
        (Err(error), Ok(_)) => panic!("the file is read whole, but refused in pieces: {error}"),
    }
}
