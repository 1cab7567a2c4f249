//! Files assembled from choices. Mutated zstd frames do not decompress, so here the fuzzer chooses their contents,
//! mostly valid ones: only these reach the decoders of tokens and values.

use std::cell::RefCell;

use relightable_photo::format::{HEADER_BYTES, ScanCoding};
use relightable_photo::transport::{CHANNELS, Extent, Geometry};

use crate::choices::Choices;
use crate::source;

/// Pixels along a side of a block of [`ScanCoding::Transform`].
const BLOCK_SIDE: u32 = 8;
const END_OF_RUN: u8 = 0;
const SIXTEEN_ZEROS: u8 = 0xF0;
const KLT_BYTES: usize = 2 * CHANNELS * CHANNELS;

/// A scan and its chunks, each with its content bytes.
struct CraftedScan {
    coding: ScanCoding,
    first: u16,
    count: u16,
    step: f32,
    snr: f32,
    basis: Vec<u8>,
    chunks: Vec<(Vec<u8>, u32)>,
}

impl CraftedScan {
    fn new(coding: ScanCoding, first: u16, count: u16, choices: &mut Choices<'_>) -> Self {
        let step = match choices.below(8) {
            0 | 1 => 1.0,
            2 => 0.01,
            3 => f32::MIN_POSITIVE,
            4 => 1e-45,
            5 => f32::MAX,
            6 => 1e30,
            _ => choices.f32(),
        };
        Self {
            coding,
            first,
            count,
            step,
            snr: choices.of([0.0, 20.0, 40.0, f32::NAN, f32::INFINITY]),
            basis: Vec::new(),
            chunks: Vec::new(),
        }
    }

    fn end(&self) -> usize {
        usize::from(self.first) + usize::from(self.count)
    }

    /// Number of basis functions in the basis chunk, if earlier scans have brought `known`.
    fn new_functions(&self, known: usize) -> usize {
        match self.coding.is_direct() {
            true => 0,
            false => self.end().saturating_sub(known),
        }
    }
}

/// A whole file with correct lengths and checksums.
pub fn file(choices: &mut Choices<'_>) -> Vec<u8> {
    let geometry = source::geometry(choices);
    let rank = match choices.below(4) {
        0 => 0,
        1 => 1,
        2 => usize::from(choices.below(6)),
        _ => usize::from(choices.below(40)),
    };
    let mut scans = scans(choices, &geometry, rank);
    let area = geometry.window.area();
    let mut known = 0;
    let mut has_klt = vec![false; geometry.tile_grid().area()];
    for scan in &mut scans {
        let new_functions = scan.new_functions(known);
        known += new_functions;
        if new_functions > 0 {
            scan.basis = basis(choices, new_functions, area);
        }
        for (has_klt, rect) in has_klt.iter_mut().zip(geometry.tiles()) {
            let chunk = match choices.chance(96) {
                true => (Vec::new(), 0),
                false => chunk(choices, scan, rect.extent, area, has_klt),
            };
            scan.chunks.push(chunk);
        }
    }
    assemble(choices, &geometry, rank, &scans)
}

fn scans(choices: &mut Choices<'_>, geometry: &Geometry, rank: usize) -> Vec<CraftedScan> {
    let area = geometry.window.area();
    let coefficients = match choices.chance(64) {
        true => ScanCoding::Halves,
        false => ScanCoding::Transform,
    };
    let functions = match choices.chance(64) {
        true => ScanCoding::DirectHalves,
        false => ScanCoding::Direct,
    };
    let (mut scans, mut known) = (Vec::new(), 0);
    for _ in 0..choices.below(7) {
        let direct = rank == 0 || choices.chance(80);
        let (max_first, end) = if direct {
            (area - 1, area)
        } else {
            (known.min(rank - 1), rank)
        };
        let first = usize::from(choices.byte()) % (max_first + 1);
        let count = 1 + usize::from(choices.byte()) % (end - first);
        let coding = if direct { functions } else { coefficients };
        let mut scan = CraftedScan::new(coding, first as u16, count as u16, choices);
        if choices.rarely() {
            (scan.first, scan.count) = (choices.u16(), choices.u16());
            scan.coding = choices.of([
                ScanCoding::Transform,
                ScanCoding::Halves,
                ScanCoding::Direct,
                ScanCoding::DirectHalves,
            ]);
        }
        known += scan.new_functions(known);
        scans.push(scan);
    }
    if known < rank {
        let (first, count) = (known as u16, (rank - known) as u16);
        scans.push(CraftedScan::new(coefficients, first, count, choices));
    }
    if choices.rarely() {
        // Many scans; a small input leaves most of them without chunks.
        for _ in 0..choices.byte() {
            let coding = if rank > 0 { coefficients } else { functions };
            scans.push(CraftedScan::new(coding, 0, 1, choices));
        }
    }
    scans
}

/// A basis chunk.
fn basis(choices: &mut Choices<'_>, functions: usize, area: usize) -> Vec<u8> {
    let mut content = choices.fill(functions);
    if !choices.rarely() {
        content.iter_mut().for_each(|exponent| *exponent %= 31);
    }
    content.extend(choices.fill(2 * functions * area));
    frame(choices, &content)
}

/// A tile chunk and its content bytes.
fn chunk(
    choices: &mut Choices<'_>,
    scan: &CraftedScan,
    extent: Extent,
    area: usize,
    has_klt: &mut bool,
) -> (Vec<u8>, u32) {
    let count = usize::from(scan.count);
    match scan.coding {
        ScanCoding::Halves | ScanCoding::DirectHalves => {
            let numbers = extent.area() * CHANNELS * count.min(area.max(40));
            let mut content = choices.fill(2 * numbers);
            if !choices.rarely() {
                // Finite values: not all bits of the exponent are set.
                content[numbers..]
                    .iter_mut()
                    .for_each(|high| *high &= !0x40);
            }
            let bytes = frame(choices, &content);
            (bytes, content.len() as u32)
        }
        ScanCoding::Direct => {
            let runs = std::iter::repeat_n(count.min(area) * CHANNELS, extent.area());
            token_string(choices, runs)
        }
        ScanCoding::Transform => {
            let mut bytes = Vec::new();
            if scan.first == 0 && !*has_klt {
                *has_klt = true;
                bytes = choices.fill(KLT_BYTES);
            }
            let blocks = extent.width.div_ceil(BLOCK_SIDE) * extent.height.div_ceil(BLOCK_SIDE);
            let blocks = blocks as usize * count.min(40);
            let area = (BLOCK_SIDE * BLOCK_SIDE) as usize;
            let (main, main_tokens) = token_string(choices, std::iter::repeat_n(area, blocks));
            let (side, side_tokens) = token_string(choices, std::iter::repeat_n(2 * area, blocks));
            let mut length = main.len() as u32;
            if choices.rarely() {
                length = choices.u32();
            }
            bytes.extend(length.to_le_bytes());
            bytes.extend(main);
            bytes.extend(side);
            (bytes, main_tokens + side_tokens)
        }
    }
}

/// A token string that runs are added to.
#[derive(Default)]
struct TokenWriter {
    /// `[context]`
    tokens: [Vec<u8>; 3],
    has_contexts: bool,
    bits: Vec<u8>,
    /// Bits not yet in `bits`, the first one lowest.
    pending: u32,
    pending_count: u32,
}

impl TokenWriter {
    fn token(&mut self, before: &mut Option<u8>, token: u8) {
        let context = match before {
            None => 0,
            Some(before) if *before & 15 <= 1 => 1,
            Some(_) => 2,
        };
        self.tokens[if self.has_contexts { context } else { 0 }].push(token);
        *before = Some(token);
    }

    fn number(&mut self, bits: u32, size: u8) {
        self.pending |= (bits & ((1 << size) - 1)) << self.pending_count;
        self.pending_count += u32::from(size);
        while self.pending_count >= 8 {
            self.bits.push(self.pending as u8);
            self.pending >>= 8;
            self.pending_count -= 8;
        }
    }

    /// Adds a run of `length` numbers in at most `max_tokens` tokens and an end of run.
    fn run(&mut self, choices: &mut Choices<'_>, length: usize, max_tokens: u8) {
        let (mut at, mut before) = (0, None);
        for _ in 0..max_tokens {
            let token = choices.byte();
            let (zeros, size) = (usize::from(token >> 4), token & 15);
            if token == SIXTEEN_ZEROS {
                // The zeros may extend beyond the run.
                at += 16;
                self.token(&mut before, token);
            } else if at + zeros < length && size > 0 {
                at += zeros + 1;
                self.token(&mut before, token);
                let bits = u32::from(choices.byte()) * 0x8101;
                self.number(bits, size);
            }
            if at >= length {
                return;
            }
        }
        self.token(&mut before, END_OF_RUN);
    }
}

/// A token string of runs of these lengths, and its number of tokens.
fn token_string(choices: &mut Choices<'_>, lengths: impl Iterator<Item = usize>) -> (Vec<u8>, u32) {
    let mut writer = TokenWriter {
        has_contexts: choices.chance(128),
        ..TokenWriter::default()
    };
    // Number of further runs without numbers.
    let mut empty_runs = 0u32;
    for length in lengths {
        let max_tokens = match empty_runs {
            0 => match choices.byte() {
                few @ 0..=15 => few,
                many @ 16..=31 => 8 * (many - 15),
                other => {
                    empty_runs = u32::from(other - 31) * if other > 240 { 16 } else { 1 };
                    0
                }
            },
            _ => {
                empty_runs -= 1;
                0
            }
        };
        writer.run(choices, length, max_tokens);
    }
    if writer.pending_count > 0 {
        writer.bits.push(writer.pending as u8);
    }
    let mut streams = if writer.has_contexts { 3 } else { 1 };
    if choices.chance(16) {
        damage(choices, &mut writer);
    }
    if choices.rarely() {
        streams = choices.byte();
    }
    let all = writer.tokens.iter().map(Vec::len).sum::<usize>() as u32;
    let mut bytes = vec![streams];
    let mut frames = Vec::new();
    for tokens in &writer.tokens[..usize::from(streams).min(3)] {
        let frame = match tokens.is_empty() {
            true => Vec::new(),
            false => frame(choices, tokens),
        };
        let [mut token_count, mut frame_bytes] = [tokens.len() as u32, frame.len() as u32];
        if choices.rarely() {
            (token_count, frame_bytes) = (choices.u32(), choices.u32());
        }
        bytes.extend(token_count.to_le_bytes());
        bytes.extend(frame_bytes.to_le_bytes());
        frames.extend(frame);
    }
    bytes.extend(frames);
    bytes.extend(writer.bits);
    let content_bytes = if choices.rarely() { choices.u32() } else { all };
    (bytes, content_bytes)
}

/// Changes a token string in a way that no writer does.
fn damage(choices: &mut Choices<'_>, writer: &mut TokenWriter) {
    let stream = usize::from(choices.below(3));
    let tokens = &mut writer.tokens[stream];
    let at = usize::from(choices.u16()) % tokens.len().max(1);
    match choices.below(7) {
        0 => tokens.truncate(at),
        1 => tokens.insert(at, choices.byte()),
        2 if !tokens.is_empty() => tokens[at] = choices.byte(),
        3 => *tokens = choices.fill(usize::from(choices.0.first().copied().unwrap_or(0))),
        4 => writer.bits.truncate(at),
        5 => writer.bits.push(choices.byte()),
        _ => writer.bits = choices.fill(at),
    }
}

thread_local! {
    static COMPRESSOR: RefCell<zstd::bulk::Compressor<'static>> =
        RefCell::new(zstd::bulk::Compressor::new(1).expect("level 1 is a level"));
}

/// One zstd frame, or rarely a damaged one.
fn frame(choices: &mut Choices<'_>, content: &[u8]) -> Vec<u8> {
    let mut frame = COMPRESSOR.with_borrow_mut(|compressor| {
        compressor
            .compress(content)
            .expect("compression in memory does not fail")
    });
    if !choices.rarely() {
        return frame;
    }
    match choices.below(6) {
        0 => {
            let at = usize::from(choices.u16()) % frame.len();
            frame[at] = choices.byte();
        }
        1 => frame.truncate(usize::from(choices.u16()) % frame.len()),
        2 => frame.extend(choices.fill(usize::from(choices.0.first().copied().unwrap_or(0)))),
        3 => frame.extend(frame.clone()),
        4 => frame = choices.up_to(64).to_vec(),
        // A frame without a content size, and with another window.
        _ => {
            let level = i32::from(choices.below(19)) + 1;
            frame = zstd::stream::encode_all(content, level)
                .expect("compression in memory does not fail");
        }
    }
    frame
}

/// Header, directory, extensions, metadata and scans, one after another.
fn assemble(
    choices: &mut Choices<'_>,
    geometry: &Geometry,
    rank: usize,
    scans: &[CraftedScan],
) -> Vec<u8> {
    let mut directory = Vec::new();
    for scan in scans {
        let coding = match scan.coding {
            ScanCoding::Transform => 1u16,
            ScanCoding::Halves => 2,
            ScanCoding::Direct => 3,
            ScanCoding::DirectHalves => 4,
        };
        for field in [coding, scan.first, scan.count, 0] {
            directory.extend(field.to_le_bytes());
        }
        directory.extend(scan.step.to_le_bytes());
        directory.extend(scan.snr.to_le_bytes());
        directory.extend((scan.basis.len() as u32).to_le_bytes());
        directory.extend(crc32c::crc32c(&scan.basis).to_le_bytes());
    }
    let chunks = || scans.iter().flat_map(|scan| &scan.chunks);
    directory.extend(chunks().flat_map(|(bytes, _)| (bytes.len() as u32).to_le_bytes()));
    let content_bytes = |(bytes, content_bytes): &(Vec<u8>, u32)| match bytes.is_empty() {
        true => 0,
        false => *content_bytes,
    };
    directory.extend(chunks().flat_map(|chunk| content_bytes(chunk).to_le_bytes()));
    let crc = |bytes: &[u8]| {
        if bytes.is_empty() {
            0
        } else {
            crc32c::crc32c(bytes)
        }
    };
    directory.extend(chunks().flat_map(|(bytes, _)| crc(bytes).to_le_bytes()));
    let directory = COMPRESSOR.with_borrow_mut(|compressor| {
        compressor
            .compress(&directory)
            .expect("compression in memory does not fail")
    });
    let extensions = match choices.rarely() {
        true => choices.up_to(40).to_vec(),
        false => Vec::new(),
    };
    let metadata = match choices.rarely() {
        true => choices.up_to(80).to_vec(),
        false => b"{}".to_vec(),
    };
    let sections = [&directory, &extensions, &metadata];
    let chunk_bytes: usize = scans
        .iter()
        .map(|scan| {
            let chunks = scan.chunks.iter().map(|(bytes, _)| bytes.len());
            scan.basis.len() + chunks.sum::<usize>()
        })
        .sum();
    let bytes =
        HEADER_BYTES + sections.iter().map(|section| section.len()).sum::<usize>() + chunk_bytes;

    let mut file = b"\xABLTM 10\xBB\r\n\x1A\n\x01\0\0\0".to_vec();
    for side in geometry.sides().as_flattened() {
        file.extend(side.to_le_bytes());
    }
    for a in geometry.correspondence.affine.iter().flatten() {
        file.extend(a.to_le_bytes());
    }
    file.extend((bytes as u64).to_le_bytes());
    file.extend((rank as u32).to_le_bytes());
    file.extend((scans.len() as u32).to_le_bytes());
    for section in sections {
        file.extend((section.len() as u32).to_le_bytes());
        file.extend(crc32c::crc32c(section).to_le_bytes());
    }
    file.extend([0; 12]);
    file.extend(crc32c::crc32c(&file).to_le_bytes());
    for section in sections {
        file.extend(section);
    }
    for scan in scans {
        file.extend(&scan.basis);
        for (bytes, _) in &scan.chunks {
            file.extend(bytes);
        }
    }
    file
}
