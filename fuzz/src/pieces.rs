//! A file in pieces.

use relightable_photo::format::{FileIndex, Interest, Reader};
use relightable_photo::transport::Decibels;

use crate::choices::Choices;
use crate::reading::{self, LIMITS, Read, check_transport};

/// A file as a browser may get it: what is wanted, in no order, in pieces of any size, some of it again.
/// What it gives when all of it that is there has been fed.
///
/// # Panics
/// If the reader wants what it has, or never has enough.
pub fn read(file: &[u8], choices: &mut Choices<'_>) -> Read {
    let mut reader = Reader::new(LIMITS);
    let mut failed = None;
    // Each turn feeds at least a byte that was not there.
    for _ in 0..=2 * file.len() {
        let interest = match choices.chance(64) && reader.index().is_some() {
            true => Interest {
                viewport: Some((0..choices.byte().into(), 0..choices.byte().into())),
                snr: choices.chance(128).then(|| Decibels(choices.byte().into())),
            },
            false => Interest::default(),
        };
        let there = |reader: &Reader, interest: &Interest| -> Vec<_> {
            let wanted = reader.wants(interest).into_iter();
            wanted
                .filter(|range| range.start < file.len() as u64)
                .collect()
        };
        let mut ranges = there(&reader, &interest);
        if ranges.is_empty() {
            ranges = there(&reader, &Interest::default());
        }
        if ranges.is_empty() {
            break;
        }
        let range = &ranges[usize::from(choices.u16()) % ranges.len()];
        let (start, end) = (range.start as usize, (range.end as usize).min(file.len()));
        let mut range = start..end;
        if choices.chance(160)
            && let Some(part) = part(reader.index(), &range, choices)
        {
            range = part;
        }
        let length = match choices.byte() {
            0 => range.len(),
            length => range.len().min(usize::from(length) * 2),
        };
        range.end = range.start + length;
        let before = reader.progress().bytes;
        if choices.chance(32) {
            // And some of what is there already just before it.
            let wanted = reader.wants(&Interest::default());
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
            Ok(()) => assert!(reader.progress().bytes > before, "what was wanted is new"),
            Err(error) => {
                failed = Some(error);
                break;
            }
        }
    }
    let Some(error) = failed else {
        assert!(
            reader
                .wants(&Interest::default())
                .iter()
                .all(|range| range.start >= file.len() as u64),
            "it never has enough"
        );
        return reader.finish();
    };
    // Whatever else is done with it then, nothing worse happens.
    let mut at = usize::from(choices.u16()) % file.len().max(1);
    while at < file.len() {
        let end = file.len().min(at + 1 + usize::from(choices.u16()));
        let _ = reader.feed(at as u64, &file[at..end]);
        at = end;
    }
    let _ = reader.wants(&Interest::default());
    if let Ok((transport, _)) = reader.finish_early() {
        check_transport(&transport);
    }
    Err(error)
}

/// A part within a range.
fn part(
    index: Option<&FileIndex>,
    range: &std::ops::Range<usize>,
    choices: &mut Choices<'_>,
) -> Option<std::ops::Range<usize>> {
    let index = index?;
    let ranges = index.chunks().map(|part| index.range(part));
    let ranges = ranges.map(|part| part.start as usize..part.end as usize);
    let inside = ranges.filter(|part| part.start >= range.start && part.end <= range.end);
    let inside: Vec<_> = inside.collect();
    let at = usize::from(choices.u16()).checked_rem(inside.len())?;
    inside.get(at).cloned()
}

/// Reads a file in pieces and whole.
///
/// # Panics
/// If they differ.
pub fn check(file: &[u8], choices: &mut Choices<'_>) {
    // Nobody wants what follows the end: a reader that gets it all the same refuses it.
    let end = reading::index(file).map(|index| index.header.file_bytes);
    let end = end.and_then(|end| usize::try_from(end).ok());
    let file = &file[..end.unwrap_or(file.len()).min(file.len())];
    match (read(file, choices), reading::whole(file)) {
        (Ok(pieces), Ok(whole)) => assert!(pieces == whole, "pieces make another transport"),
        (Err(_), Err(_)) => {}
        (Ok(_), Err(error)) => panic!("in pieces it is read, whole it is not: {error}"),
        (Err(error), Ok(_)) => panic!("whole it is read, in pieces it is not: {error}"),
    }
}
