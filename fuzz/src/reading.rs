//! All ways of reading a file, and the properties that must hold.

use relightable_photo::format::{
    self, ChunkSelection, FIRST_BYTES, FileIndex, FormatError, HEADER_BYTES, Limits, LtmReader,
    MetadataText, ShardId,
};
use relightable_photo::pyramid::PyramidReader;
use relightable_photo::transport::{CHANNELS, Decibels, Tile, Transport, entry_slot};

use crate::choices::Choices;
use crate::heap::with_peak_bytes;
use crate::source::{ArbitraryInput, TargetChoice};

/// The memory budget of fuzzed readers.
pub const LIMITS: Limits = Limits {
    decoded_bytes: 40 << 20,
};
/// Maximum bytes of messages and ranges, which the budget does not count.
const UNCOUNTED_BYTES: usize = 64 << 10;

/// The result of reading a file.
pub type Read = Result<(Transport, MetadataText), FormatError>;

/// Reads the whole file in one piece.
pub fn whole(file: &[u8]) -> Read {
    let mut reader = LtmReader::new(LIMITS);
    reader.feed(0, file)?;
    reader.finish()
}

/// The file index, if it is valid and complete.
pub fn index(file: &[u8]) -> Option<FileIndex> {
    let mut reader = LtmReader::new(LIMITS);
    reader.feed(0, &file[..file.len().min(HEADER_BYTES)]).ok()?;
    let end = usize::try_from(reader.index_bytes()?).ok()?;
    reader.feed(0, file.get(..end)?).ok()?;
    reader.index().cloned()
}

/// Checks the properties of a file's index, and of the ranges that a reader wants.
///
/// # Panics
/// If one does not hold.
pub fn check_index(file: &[u8], choices: &mut Choices<'_>) {
    let mut reader = LtmReader::new(LIMITS);
    assert_eq!(reader.wants(&ChunkSelection::default()), [0..FIRST_BYTES]);
    if reader
        .feed(0, &file[..file.len().min(HEADER_BYTES)])
        .is_err()
    {
        return;
    }
    let Some(end) = reader.index_bytes() else {
        return;
    };
    // A frame is at most about as long as its content; extensions and metadata have limits of their own.
    let max_bytes = HEADER_BYTES as u64 + 2 * LIMITS.decoded_bytes + (16 << 20) + (1 << 20);
    assert!(
        end <= max_bytes,
        "the index has {end} bytes, but the limits allow {max_bytes}"
    );
    assert_eq!(
        reader.wants(&ChunkSelection::default()),
        [file.len().min(HEADER_BYTES) as u64..end]
    );
    let Some(index) = index(file) else {
        return;
    };
    let geometry = &index.header.geometry;
    assert!(geometry.check().is_ok());
    assert_eq!(index.tiles(), geometry.tile_grid().area());
    let mut next = index.header.index_bytes();
    for chunk in index.chunks() {
        let range = index.range(chunk);
        assert!(
            range.start == next && range.end > next,
            "chunks do not follow each other"
        );
        next = range.end;
    }
    assert_eq!(next, index.header.file_bytes);
    for scan in &index.scans {
        assert!(scan.step > 0.0 && scan.step.is_finite());
    }
    let mut reader = LtmReader::new(LIMITS);
    if reader.feed(0, &file[..end as usize]).is_err() {
        return;
    }
    let all = reader.wants(&ChunkSelection::default());
    let sum: u64 = all.iter().map(|range| range.end - range.start).sum();
    assert_eq!(
        sum,
        index.header.file_bytes - end,
        "the reader does not want all chunks"
    );
    let selection = ChunkSelection {
        viewport: Some((
            choices.u32()..choices.u32(),
            choices.u16().into()..choices.u16().into(),
        )),
        snr: Some(Decibels(choices.f64())),
    };
    for range in reader.wants(&selection) {
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
    let (early, _) = early.expect("a file index gives a dark transport");
    assert_eq!(early.tiles.len(), index.tiles());
    assert!(early.tiles.iter().all(|tile| tile.is_dark()));
}

/// Checks the table of a file of several levels, and reads its first shards.
///
/// # Panics
/// If a property does not hold.
pub fn check_levels(file: &[u8]) {
    let Some(root) = index(file) else {
        return;
    };
    let root_bytes = root.header.file_bytes;
    let Ok(Some(reader)) = PyramidReader::new(root, LIMITS) else {
        return;
    };
    let table = reader.table();
    let level = table.levels() - 1;
    check_shard(file, &reader, ShardId { level, x: 0, y: 0 });
    let mut next = root_bytes;
    for (number, shard) in table.shards().iter().enumerate() {
        let range = reader.range(*shard).expect("a shard of the table");
        assert!(range.start == next && range.start <= range.end);
        next = range.end;
        let rect = table.rect(*shard);
        let camera = table.camera(shard.level);
        assert!(rect.x + rect.extent.width <= camera.width && rect.extent.area() > 0);
        assert!(rect.y + rect.extent.height <= camera.height);
        if number < 8 {
            check_shard(file, &reader, *shard);
        }
    }
    assert_eq!(next, reader.file_bytes());
}

fn check_shard(file: &[u8], reader: &PyramidReader, shard: ShardId) {
    let fetch = |range: std::ops::Range<u64>| -> Result<Vec<u8>, FormatError> {
        let [start, end] = [range.start, range.end].map(|at| at.min(file.len() as u64) as usize);
        Ok(file[start..end].to_vec())
    };
    let rect = reader.table().rect(shard);
    let (read, peak) = with_peak_bytes(|| reader.shard(shard, rect, fetch));
    check_peak(peak.saturating_sub(2 * file.len()));
    let Ok(index) = reader.index(shard, fetch) else {
        assert!(read.is_err(), "a shard without a valid index was read");
        return;
    };
    let geometry = &index.header.geometry;
    assert!(geometry.check().is_ok());
    let plane = reader.table().light(shard.level);
    let [u, v] = geometry.correspondence.origin.light;
    assert!(u + geometry.light.width <= plane.width && v + geometry.light.height <= plane.height);
    if let Ok(shard) = read {
        check_transport(&shard.transport);
    }
}

/// Checks the properties of a transport that was read.
///
/// # Panics
/// If one does not hold.
pub fn check_transport(transport: &Transport) {
    let geometry = &transport.geometry;
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
        let texels = Tile::texels(rect, rank);
        assert!(coefficients.is_dark() || coefficients.codes.len() == texels);
        let pixels = functions.pixels().count();
        assert!(functions.is_dark() || pixels == rect.extent.area());
        for entries in functions.pixels() {
            let slots = entries.iter().map(entry_slot);
            assert!(slots.clone().is_sorted_by(|a, b| a < b));
            assert!(slots.last() < Some(area));
        }
    }
}

/// Reads a file whole within the memory budget, tile by tile, and with [`format::check`] chunk by chunk.
///
/// # Panics
/// If one accepts the file and another refuses it, or tiles differ.
pub fn check_file(file: &[u8]) -> Read {
    let (read, peak) = with_peak_bytes(|| whole(file));
    check_peak(peak);
    if let Ok((transport, _)) = &read {
        check_transport(transport);
    }
    let Some(index) = index(file) else {
        assert!(read.is_err(), "a file without a valid index was read");
        return read;
    };
    if file.len() as u64 != index.header.file_bytes {
        assert!(read.is_err(), "a file of another length was read");
        return read;
    }
    let checked = index.chunks().try_for_each(|chunk| {
        let range = index.range(chunk);
        let bytes = &file[range.start as usize..range.end as usize];
        format::check(&index, chunk, bytes)
    });
    let tile_by_tile = decode_tiles(&index, file);
    match (&read, &tile_by_tile) {
        (Ok((transport, _)), Ok(tiles)) => assert!(transport.tiles == *tiles, "tiles differ"),
        (Err(_), Err(_)) => {}
        (Ok(_), Err(error)) => panic!("the file is read whole, but refused tile by tile: {error}"),
        (Err(error), Ok(_)) => panic!("the file is read tile by tile, but refused whole: {error}"),
    }
    match (&read, &checked) {
        (Ok(_), Ok(())) | (Err(_), Err(_)) => {}
        (Ok(_), Err(error)) => panic!("the file is read, but the check refuses it: {error}"),
        (Err(error), Ok(())) => panic!("the check accepts the file, but it is not read: {error}"),
    }
    read
}

/// Decodes the tiles of a file separately.
fn decode_tiles(index: &FileIndex, file: &[u8]) -> Result<Vec<Tile>, FormatError> {
    let fetch = |chunk| {
        let range = index.range(chunk);
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
        "reading allocates {peak} bytes, but {allowed} are allowed"
    );
}

/// Reads a file scan by scan, with a preview after each scan.
///
/// # Panics
/// If that exceeds the memory budget.
pub fn check_previews(file: &[u8]) {
    let Some(index) = index(file) else {
        return;
    };
    let ends = (0..index.scans.len()).map(|scan| index.scan_range(scan).end);
    let ends: Vec<u64> = std::iter::once(index.header.index_bytes())
        .chain(ends)
        .collect();
    let (previews, peak) = with_peak_bytes(|| -> Result<(), FormatError> {
        let mut reader = LtmReader::new(LIMITS);
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
    drop(previews); // `check_file` checks errors
    check_peak(peak);
}

/// Reads the first half of a file's chunks.
///
/// # Panics
/// If that gives no light transport.
pub fn check_early(file: &[u8]) {
    let Some(index) = index(file) else {
        return;
    };
    let index_bytes = index.header.index_bytes() as usize;
    let mut reader = LtmReader::new(LIMITS);
    let chunk_bytes = file.len() - index_bytes;
    if reader
        .feed(0, &file[..index_bytes + chunk_bytes / 2])
        .is_err()
    {
        return;
    }
    let (early, _) = reader
        .finish_early()
        .expect("a prefix gives light transport");
    check_transport(&early);
}

/// Checks the error of a transport against the encoder's input.
///
/// # Panics
/// If it exceeds the error that the file declares and that of rounding to codes.
pub fn check_error(
    input: &ArbitraryInput,
    transport: &Transport,
    declared: Option<Decibels>,
    target: TargetChoice,
) {
    let (mut energy, mut error, mut code_error) = (0.0, 0.0, 0.0);
    for (i, tile) in transport.tiles.iter().enumerate() {
        energy += input.energy(i);
        let got = tile.functions(&transport.geometry, &transport.basis).tau;
        for (got, want) in got.iter().zip(input.functions(i).tau) {
            for c in 0..CHANNELS {
                let (got, want) = (f64::from(got[c]), f64::from(want[c]));
                error += (got - want) * (got - want);
            }
        }
        // Half a code at most for each slot, and for each coefficient of basis functions of unit norm.
        let squared_error = |step: [f32; CHANNELS]| -> f64 {
            step.iter().map(|step| f64::from(*step).powi(2) / 4.0).sum()
        };
        let pixels = tile.rect().extent.area();
        let slots = match tile.functions.is_dark() {
            true => 0,
            false => pixels * transport.geometry.window.area(),
        };
        code_error += squared_error(tile.functions.step) * slots as f64;
        let coefficients = pixels * transport.basis.rank().pow(2);
        code_error += squared_error(tile.coefficients.step) * coefficients as f64;
    }
    let Some(declared) = declared else {
        assert!(
            energy == 0.0 || error <= energy,
            "a file without values has an error above the energy: {input:?}, {target:?}"
        );
        return;
    };
    if let TargetChoice::Snr(snr) = target
        && (5.0..60.0).contains(&snr.0)
    {
        assert!(
            declared.0 > snr.0 - 0.5,
            "{declared}: {input:?}, {target:?}"
        );
    }
    let declared_error = energy * 10f64.powf(-declared.0 / 10.0);
    // The encoder adds the errors of coefficients, colours, the first basis function and the others as if they were
    // independent. In a picture of few pixels they may have the same sign, and so may the errors of codes.
    let max_error = ((4.0 * declared_error).sqrt() + code_error.sqrt()).powi(2) + 1e-9 * energy;
    assert!(
        error <= max_error,
        "error {error:e} of energy {energy:e}; {declared} declares {declared_error:e}, codes add {code_error:e}: \
         {input:?}, {target:?}"
    );
}
