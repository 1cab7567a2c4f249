//! Reading a file in all the ways there are, and what must hold of each.

use relightable_photo::format::{
    self, FIRST_BYTES, FormatError, HEADER_BYTES, Head, Interest, Limits, MetadataJson, Reader,
};
use relightable_photo::transport::{CHANNELS, CoefficientTile, Decibels, Tile, Transport};

use crate::choices::Choices;
use crate::heap::most_held;
use crate::source::{Given, Wanted};

/// What decoding may ask for. 16 MiB of it are for tokens, of which fuzzers make few.
pub const LIMITS: Limits = Limits {
    decoded_bytes: 40 << 20,
};
/// Most bytes of a part before compression.
const MOST_PLAIN: u64 = 8 << 20;
/// Bytes not worth counting: messages, tables of a file without tiles.
const SMALL: usize = 64 << 10;

/// What a file gives.
pub type Read = Result<(Transport, MetadataJson), FormatError>;

/// The whole file in one piece, to its end.
pub fn whole(file: &[u8]) -> Read {
    let mut reader = Reader::new(LIMITS);
    reader.feed(0, file)?;
    reader.finish()
}

/// The head, if it can be read and file bytes suffice.
pub fn head(file: &[u8]) -> Option<Head> {
    let mut reader = Reader::new(LIMITS);
    reader.feed(0, &file[..file.len().min(HEADER_BYTES)]).ok()?;
    let end = usize::try_from(reader.head_bytes()?).ok()?;
    reader.feed(0, file.get(..end)?).ok()?;
    reader.head().cloned()
}

/// What must hold of every head.
///
/// # Panics
/// If it does not.
pub fn check_head(file: &[u8], choices: &mut Choices<'_>) {
    let mut reader = Reader::new(LIMITS);
    assert_eq!(reader.wants(&Interest::default()), [0..FIRST_BYTES]);
    if reader.feed(0, &file[..file.len().min(HEADER_BYTES)]).is_err() {
        return;
    }
    let Some(end) = reader.head_bytes() else {
        return;
    };
    // What decompresses to so much is at most about as long; the rest has limits of its own.
    let most = HEADER_BYTES as u64 + 2 * LIMITS.decoded_bytes + (16 << 20) + (1 << 20);
    assert!(end <= most, "the head has {end} bytes, though limits allow {most}");
    assert_eq!(
        reader.wants(&Interest::default()),
        [file.len().min(HEADER_BYTES) as u64..end]
    );
    let Some(head) = head(file) else {
        return;
    };
    let geometry = head.header.geometry;
    assert!(geometry.validate().is_ok());
    assert_eq!(head.tiles(), geometry.tile_grid().area());
    let mut next = head.header.head_bytes();
    for part in head.parts() {
        let range = head.range(part);
        assert!(range.start == next && range.end > next, "parts are in a row");
        next = range.end;
    }
    assert_eq!(next, head.header.file_bytes);
    for scan in &head.scans {
        assert!(scan.step > 0.0 && scan.step.is_finite());
    }
    let mut reader = Reader::new(LIMITS);
    if reader.feed(0, &file[..end as usize]).is_err() {
        return;
    }
    let all = reader.wants(&Interest::default());
    let sum: u64 = all.iter().map(|range| range.end - range.start).sum();
    assert_eq!(sum, head.header.file_bytes - end, "all of it is wanted");
    let interest = Interest {
        viewport: Some((
            choices.u32()..choices.u32(),
            choices.u16().into()..choices.u16().into(),
        )),
        quality: Some(Decibels(choices.f64())),
    };
    for range in reader.wants(&interest) {
        let inside = all.iter().any(|all| all.start <= range.start && range.end <= all.end);
        assert!(inside && range.start < range.end);
    }
    let progress = reader.progress();
    assert_eq!((progress.bytes, progress.file_bytes), (end, Some(head.header.file_bytes)));
    let early = reader.finish_early();
    let (early, _) = early.expect("a head alone relights, darkly");
    assert_eq!(early.tiles.len(), head.tiles());
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
    assert!(transport.basis.kernels.iter().all(|kernel| kernel.len() == area));
    for (tile, rect) in transport.tiles.iter().zip(tiles) {
        let (coefficients, functions) = (&tile.coefficients, &tile.functions);
        assert_eq!((coefficients.rect, functions.rect), (rect, rect));
        let steps = coefficients.step.iter().chain(&functions.step);
        assert!(steps.into_iter().all(|step| step.is_normal() && *step > 0.0));
        let texels = CoefficientTile::texels(rect, rank);
        assert!(coefficients.is_dark() || coefficients.codes.len() == texels);
        let codes = rect.extent.area() * area;
        assert!(functions.is_dark() || functions.codes.len() == codes);
    }
}

/// Reads a file, and checks it part by part: one takes it where the other does, and neither in more
/// memory than the head foretells.
///
/// # Panics
/// If one does not.
pub fn check_file(file: &[u8]) -> Read {
    let (read, most) = most_held(|| whole(file));
    if let Ok((transport, _)) = &read {
        check_transport(transport);
    }
    let Some(head) = head(file) else {
        assert!(read.is_err(), "a file without a head was read");
        return read;
    };
    let foretold = foretold(&head, file);
    assert!(most <= foretold, "reading holds {most} bytes, {foretold} were foretold");
    if file.len() as u64 != head.header.file_bytes {
        assert!(read.is_err(), "a file of another length was read");
        return read;
    }
    let checked = head.parts().try_for_each(|part| {
        let range = head.range(part);
        let bytes = &file[range.start as usize..range.end as usize];
        format::check(&head, part, bytes)
    });
    let by_itself = tiles_by_themselves(&head, file);
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
fn tiles_by_themselves(head: &Head, file: &[u8]) -> Result<Vec<Tile>, FormatError> {
    let fetch = |part| {
        let range = head.range(part);
        Ok(file[range.start as usize..range.end as usize].to_vec())
    };
    let rank = format::decode_basis::<FormatError>(head, fetch)?.rank();
    let tile = |i| {
        let tile = format::decode_tile::<FormatError>(head, i, fetch)?;
        Ok(Tile::quantise(&tile, rank))
    };
    (0..head.tiles()).map(tile).collect()
}

/// Bytes that reading may hold: what the limits count, with the tokens that there are in place of the
/// most there can be, and what is kept of the file itself.
fn foretold(head: &Head, file: &[u8]) -> usize {
    // Refused for what the header says, and then perhaps for what the directory says.
    let mut need = 0;
    let head_bytes = head.header.head_bytes() as usize;
    while let Err(error) = Reader::new(Limits { decoded_bytes: need }).feed(0, &file[..head_bytes]) {
        match error {
            FormatError::Limit { need: more, .. } if more > need => need = more,
            error => panic!("limits change another error: {error}"),
        }
    }
    let counted = (need - 2 * MOST_PLAIN) as usize;
    let plain = head.parts().filter_map(|part| {
        let tile = part.tile?;
        Some(head.entry(part.scan, tile).plain as usize)
    });
    let tokens = 2 * plain.max().unwrap_or(0);
    // Lists in JSON are shorter than in memory.
    let metadata = 16 * head.header.metadata_bytes as usize;
    counted + tokens + metadata + 4 * file.len() + SMALL
}

/// What is there of a file whose end is not: any beginning that has the head relights.
///
/// # Panics
/// If it does not.
pub fn check_early(file: &[u8]) {
    let Some(head) = head(file) else {
        return;
    };
    let head_bytes = head.header.head_bytes() as usize;
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
        assert!(energy == 0.0 || error <= energy, "all of it is lost: {given:?}, {wanted:?}");
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
