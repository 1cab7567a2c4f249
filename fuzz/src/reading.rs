//! Reading a file in all the ways there are, and what must hold of each.

use relightable_photo::format::{
    self, FIRST_BYTES, FileIndex, FormatError, HEADER_BYTES, Interest, Limits, MetadataJson, Reader,
};
use relightable_photo::transport::{CHANNELS, CoefficientTile, Decibels, Tile, Transport};

use crate::choices::Choices;
use crate::heap::with_peak_bytes;
use crate::source::{Given, Wanted};

/// The memory budget of fuzzed readers.
pub const LIMITS: Limits = Limits {
    decoded_bytes: 40 << 20,
};
/// Bytes that the budget does not count: messages, ranges.
const UNCOUNTED_BYTES: usize = 64 << 10;

/// What a file gives.
pub type Read = Result<(Transport, MetadataJson), FormatError>;

/// The whole file in one piece, to its end.
pub fn whole(file: &[u8]) -> Read {
    let mut reader = Reader::new(LIMITS);
    reader.feed(0, file)?;
    reader.finish()
}

/// The index, if it can be read and file bytes suffice.
pub fn index(file: &[u8]) -> Option<FileIndex> {
    let mut reader = Reader::new(LIMITS);
    reader.feed(0, &file[..file.len().min(HEADER_BYTES)]).ok()?;
    let end = usize::try_from(reader.index_bytes()?).ok()?;
    reader.feed(0, file.get(..end)?).ok()?;
    reader.index().cloned()
}

/// What must hold of every index.
///
/// # Panics
/// If it does not.
pub fn check_head(file: &[u8], choices: &mut Choices<'_>) {
    let mut reader = Reader::new(LIMITS);
    assert_eq!(reader.wants(&Interest::default()), [0..FIRST_BYTES]);
    if reader
        .feed(0, &file[..file.len().min(HEADER_BYTES)])
        .is_err()
    {
        return;
    }
    let Some(end) = reader.index_bytes() else {
        return;
    };
    // What decompresses to so much is at most about as long; the rest has limits of its own.
    let most = HEADER_BYTES as u64 + 2 * LIMITS.decoded_bytes + (16 << 20) + (1 << 20);
    assert!(
        end <= most,
        "the index has {end} bytes, though limits allow {most}"
    );
    assert_eq!(
        reader.wants(&Interest::default()),
        [file.len().min(HEADER_BYTES) as u64..end]
    );
    let Some(index) = index(file) else {
        return;
    };
    let geometry = index.header.geometry;
    assert!(geometry.validate().is_ok());
    assert_eq!(index.tiles(), geometry.tile_grid().area());
    let mut next = index.header.index_bytes();
    for part in index.chunks() {
        let range = index.range(part);
        assert!(
            range.start == next && range.end > next,
            "parts are in a row"
        );
        next = range.end;
    }
    assert_eq!(next, index.header.file_bytes);
    for scan in &index.scans {
        assert!(scan.step > 0.0 && scan.step.is_finite());
    }
    let mut reader = Reader::new(LIMITS);
    if reader.feed(0, &file[..end as usize]).is_err() {
        return;
    }
    let all = reader.wants(&Interest::default());
    let sum: u64 = all.iter().map(|range| range.end - range.start).sum();
    assert_eq!(sum, index.header.file_bytes - end, "all of it is wanted");
    let interest = Interest {
        viewport: Some((
            choices.u32()..choices.u32(),
            choices.u16().into()..choices.u16().into(),
        )),
        snr: Some(Decibels(choices.f64())),
    };
    for range in reader.wants(&interest) {
        let inside = all
            .iter()
            .any(|all| all.start <= range.start && range.end <= all.end);
        assert!(inside && range.start < range.end);
    }
    let progress = reader.progress();
    assert_eq!(
        (progress.bytes, progress.file_bytes),
        (end, Some(index.header.file_bytes))
    );
    let early = reader.finish_early();
    let (early, _) = early.expect("a index alone relights, darkly");
    assert_eq!(early.tiles.len(), index.tiles());
    assert!(early.tiles.iter().all(|tile| tile.is_dark()));
}

/// What must hold of every transport that was read.
///
/// # Panics
/// If it does not.
pub fn check_transport(transport: &Transport) {
    let geometry = transport.geometry;
    let tiles: Vec<_> = geometry.tiles().collect();
    assert_eq!(transport.tiles.len(), tiles.len());
    let (rank, area) = (transport.basis.rank(), geometry.window.area());
    assert!(
        transport
            .basis
            .kernels
            .iter()
            .all(|kernel| kernel.len() == area)
    );
    for (tile, rect) in transport.tiles.iter().zip(tiles) {
        let (coefficients, functions) = (&tile.coefficients, &tile.functions);
        assert_eq!((coefficients.rect, functions.rect), (rect, rect));
        let steps = coefficients.step.iter().chain(&functions.step);
        assert!(
            steps
                .into_iter()
                .all(|step| step.is_normal() && *step > 0.0)
        );
        let texels = CoefficientTile::texels(rect, rank);
        assert!(coefficients.is_dark() || coefficients.codes.len() == texels);
        let codes = rect.extent.area() * area;
        assert!(functions.is_dark() || functions.codes.len() == codes);
    }
}

/// Reads a file within the memory budget, and checks it chunk by chunk: both accept it or both refuse it.
///
/// # Panics
/// If one does not.
pub fn check_file(file: &[u8]) -> Read {
    let (read, peak) = with_peak_bytes(|| whole(file));
    check_peak(peak);
    if let Ok((transport, _)) = &read {
        check_transport(transport);
    }
    let Some(index) = index(file) else {
        assert!(read.is_err(), "a file without an index was read");
        return read;
    };
    if file.len() as u64 != index.header.file_bytes {
        assert!(read.is_err(), "a file of another length was read");
        return read;
    }
    let checked = index.chunks().try_for_each(|part| {
        let range = index.range(part);
        let bytes = &file[range.start as usize..range.end as usize];
        format::check(&index, part, bytes)
    });
    let by_itself = tiles_by_themselves(&index, file);
    match (&read, &by_itself) {
        (Ok((transport, _)), Ok(tiles)) => assert!(transport.tiles == *tiles, "tiles differ"),
        (Err(_), Err(_)) => {}
        (Ok(_), Err(error)) => panic!("what is read whole is not read by tiles: {error}"),
        (Err(error), Ok(_)) => panic!("what is read by tiles is not read whole: {error}"),
    }
    match (&read, &checked) {
        (Ok(_), Ok(())) | (Err(_), Err(_)) => {}
        (Ok(_), Err(error)) => panic!("what is read is not passed: {error}"),
        (Err(error), Ok(())) => panic!("what is passed is not read: {error}"),
    }
    read
}

/// The tiles of a file, each read by itself.
fn tiles_by_themselves(index: &FileIndex, file: &[u8]) -> Result<Vec<Tile>, FormatError> {
    let fetch = |part| {
        let range = index.range(part);
        Ok(file[range.start as usize..range.end as usize].to_vec())
    };
    let rank = format::decode_basis::<FormatError>(index, fetch)?.rank();
    let tile = |i| {
        let tile = format::decode_tile::<FormatError>(index, i, fetch)?;
        Ok(Tile::quantise(&tile, rank))
    };
    (0..index.tiles()).map(tile).collect()
}

fn check_peak(peak: usize) {
    let allowed = LIMITS.decoded_bytes as usize + UNCOUNTED_BYTES;
    assert!(
        peak <= allowed,
        "reading allocates {peak} bytes, {allowed} are allowed"
    );
}

/// Reads a file scan by scan, with a preview after each: neither exceeds the memory budget.
///
/// # Panics
/// If one does.
pub fn check_previews(file: &[u8]) {
    let Some(index) = index(file) else {
        return;
    };
    let ends = (0..index.scans.len()).map(|scan| index.scan_range(scan).end);
    let ends: Vec<u64> = std::iter::once(index.header.index_bytes()).chain(ends).collect();
    let (previews, peak) = with_peak_bytes(|| -> Result<(), FormatError> {
        let mut reader = Reader::new(LIMITS);
        let mut start = 0;
        for end in ends {
            let Some(bytes) = file.get(start as usize..end as usize) else {
                break;
            };
            reader.feed(start, bytes)?;
            if let Some(preview) = reader.preview()? {
                assert_eq!(preview.tiles.len(), index.tiles());
            }
            start = end;
        }
        Ok(())
    });
    drop(previews); // errors are those of `check_file`
    check_peak(peak);
}

/// Every prefix of a file that has the index gives light transport.
///
/// # Panics
/// If it does not.
pub fn check_early(file: &[u8]) {
    let Some(index) = index(file) else {
        return;
    };
    let head_bytes = index.header.index_bytes() as usize;
    let mut reader = Reader::new(LIMITS);
    let there = file.len() - head_bytes;
    if reader.feed(0, &file[..head_bytes + there / 2]).is_err() {
        return;
    }
    let (early, _) = reader.finish_early().expect("what has come relights");
    check_transport(&early);
}

/// How far a transport is from what was given: as far as the file says, and as rounding to codes adds.
///
/// # Panics
/// If it is further.
pub fn check_error(
    given: &Given,
    transport: &Transport,
    claimed: Option<Decibels>,
    wanted: Wanted,
) {
    let (mut energy, mut error, mut codes) = (0.0, 0.0, 0.0);
    for (i, tile) in transport.tiles.iter().enumerate() {
        energy += given.energy(i);
        let got = tile.functions(&transport.geometry, &transport.basis).tau;
        for (got, want) in got.iter().zip(given.functions(i).tau) {
            for c in 0..CHANNELS {
                let (got, want) = (f64::from(got[c]), f64::from(want[c]));
                error += (got - want) * (got - want);
            }
        }
        // Off by half a code at most: each element, and each coefficient of functions of unit norm.
        let worth = |step: [f32; CHANNELS]| -> f64 {
            step.iter().map(|step| f64::from(*step).powi(2) / 4.0).sum()
        };
        codes += worth(tile.functions.step) * tile.functions.codes.len() as f64;
        let coefficients = tile.rect().extent.area() * transport.basis.rank().pow(2);
        codes += worth(tile.coefficients.step) * coefficients as f64;
    }
    let Some(claimed) = claimed else {
        assert!(
            energy == 0.0 || error <= energy,
            "all of it is lost: {given:?}, {wanted:?}"
        );
        return;
    };
    if let Wanted::Snr(snr) = wanted
        && (5.0..60.0).contains(&snr.0)
    {
        assert!(claimed.0 > snr.0 - 0.5, "{claimed}: {given:?}, {wanted:?}");
    }
    let said = energy * 10f64.powf(-claimed.0 / 10.0);
    // What is said adds up what rounding does to coefficients, to colours, to the first function of the
    // basis and to the others, as if none had to do with another: in a picture of few pixels they may all
    // point the same way, as may what codes add.
    let most = ((4.0 * said).sqrt() + codes.sqrt()).powi(2) + 1e-9 * energy;
    assert!(
        error <= most,
        "{error:e} of {energy:e}, where {claimed} are {said:e} and codes {codes:e}: \
         {given:?}, {wanted:?}"
    );
}
