//! Files put together from choices. zstd frames do not survive mutation; here what is inside them is
//! chosen, and mostly such that a reader takes it: only then does it come to what lies deeper.

use std::cell::RefCell;

use relightable_photo::format::{Coding, HEADER_BYTES};
use relightable_photo::transport::{CHANNELS, Extent, Geometry};

use crate::choices::Choices;
use crate::source;

/// Pixels of a block's side in [`Coding::Transform`].
const SIDE: u32 = 8;
const END: u8 = 0;
const SIXTEEN_ZEROS: u8 = 0xF0;
const PALETTE: usize = 2 * CHANNELS * CHANNELS;

/// One scan as the directory has it.
struct Scan {
    coding: Coding,
    first: u16,
    count: u16,
    step: f32,
    snr: f32,
    basis: Vec<u8>,
    chunks: Vec<(Vec<u8>, u32)>,
}

impl Scan {
    fn new(coding: Coding, first: u16, count: u16, choices: &mut Choices<'_>) -> Self {
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

    fn brings(&self, known: usize) -> usize {
        match self.coding.is_direct() {
            true => 0,
            false => self.end().saturating_sub(known),
        }
    }
}

/// A whole file, its lengths and checksums right.
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
    let mut has_palette = vec![false; geometry.tile_grid().area()];
    for scan in &mut scans {
        let brings = scan.brings(known);
        known += brings;
        if brings > 0 {
            scan.basis = basis(choices, brings, area);
        }
        for (has_palette, rect) in has_palette.iter_mut().zip(geometry.tiles()) {
            let chunk = match choices.chance(96) {
                true => (Vec::new(), 0),
                false => chunk(choices, scan, rect.extent, area, has_palette),
            };
            scan.chunks.push(chunk);
        }
    }
    assemble(choices, &geometry, rank, &scans)
}

fn scans(choices: &mut Choices<'_>, geometry: &Geometry, rank: usize) -> Vec<Scan> {
    let area = geometry.window.area();
    let coefficients = match choices.chance(64) {
        true => Coding::Halves,
        false => Coding::Transform,
    };
    let functions = match choices.chance(64) {
        true => Coding::DirectHalves,
        false => Coding::Direct,
    };
    let (mut scans, mut known) = (Vec::new(), 0);
    for _ in 0..choices.below(7) {
        let direct = rank == 0 || choices.chance(80);
        let (most_first, end) = if direct {
            (area - 1, area)
        } else {
            (known.min(rank - 1), rank)
        };
        let first = usize::from(choices.byte()) % (most_first + 1);
        let count = 1 + usize::from(choices.byte()) % (end - first);
        let coding = if direct { functions } else { coefficients };
        let mut scan = Scan::new(coding, first as u16, count as u16, choices);
        if choices.rarely() {
            (scan.first, scan.count) = (choices.u16(), choices.u16());
            scan.coding = choices.of([
                Coding::Transform,
                Coding::Halves,
                Coding::Direct,
                Coding::DirectHalves,
            ]);
        }
        known += scan.brings(known);
        scans.push(scan);
    }
    if known < rank {
        let (first, count) = (known as u16, (rank - known) as u16);
        scans.push(Scan::new(coefficients, first, count, choices));
    }
    if choices.rarely() {
        // Many, most of which a small input leaves dark.
        for _ in 0..choices.byte() {
            let coding = if rank > 0 { coefficients } else { functions };
            scans.push(Scan::new(coding, 0, 1, choices));
        }
    }
    scans
}

/// Functions of the basis as a scan brings them.
fn basis(choices: &mut Choices<'_>, functions: usize, area: usize) -> Vec<u8> {
    let mut plain = choices.fill(functions);
    if !choices.rarely() {
        plain.iter_mut().for_each(|exponent| *exponent %= 31);
    }
    plain.extend(choices.fill(2 * functions * area));
    frame(choices, &plain)
}

/// A chunk, and what the directory is to say that it has before compression.
fn chunk(
    choices: &mut Choices<'_>,
    scan: &Scan,
    extent: Extent,
    area: usize,
    has_palette: &mut bool,
) -> (Vec<u8>, u32) {
    let count = usize::from(scan.count);
    match scan.coding {
        Coding::Halves | Coding::DirectHalves => {
            let numbers = extent.area() * CHANNELS * count.min(area.max(40));
            let mut plain = choices.fill(2 * numbers);
            if !choices.rarely() {
                // Finite: not all bits of the exponent.
                plain[numbers..].iter_mut().for_each(|high| *high &= !0x40);
            }
            let bytes = frame(choices, &plain);
            (bytes, plain.len() as u32)
        }
        Coding::Direct => {
            let blocks = std::iter::repeat_n(count.min(area) * CHANNELS, extent.area());
            tokens(choices, blocks)
        }
        Coding::Transform => {
            let mut bytes = Vec::new();
            if scan.first == 0 && !*has_palette {
                *has_palette = true;
                bytes = choices.fill(PALETTE);
            }
            let blocks = extent.width.div_ceil(SIDE) * extent.height.div_ceil(SIDE);
            let blocks = blocks as usize * count.min(40);
            let axis = (SIDE * SIDE) as usize;
            let (first, first_tokens) = tokens(choices, std::iter::repeat_n(axis, blocks));
            let (second, second_tokens) = tokens(choices, std::iter::repeat_n(2 * axis, blocks));
            let mut length = first.len() as u32;
            if choices.rarely() {
                length = choices.u32();
            }
            bytes.extend(length.to_le_bytes());
            bytes.extend(first);
            bytes.extend(second);
            (bytes, first_tokens + second_tokens)
        }
    }
}

/// Blocks of numbers on their way into a chunk.
#[derive(Default)]
struct Blocks {
    /// `[class]`
    tokens: [Vec<u8>; 3],
    apart: bool,
    bits: Vec<u8>,
    pending: u32,
    count: u32,
}

impl Blocks {
    fn token(&mut self, before: &mut Option<u8>, token: u8) {
        let class = match before {
            None => 0,
            Some(before) if *before & 15 <= 1 => 1,
            Some(_) => 2,
        };
        self.tokens[if self.apart { class } else { 0 }].push(token);
        *before = Some(token);
    }

    fn number(&mut self, bits: u32, size: u8) {
        self.pending |= (bits & ((1 << size) - 1)) << self.count;
        self.count += u32::from(size);
        while self.count >= 8 {
            self.bits.push(self.pending as u8);
            self.pending >>= 8;
            self.count -= 8;
        }
    }

    /// One block of `length` numbers, of about as many tokens as are wanted.
    fn block(&mut self, choices: &mut Choices<'_>, length: usize, wanted: u8) {
        let (mut at, mut before) = (0, None);
        for _ in 0..wanted {
            let token = choices.byte();
            let (run, size) = (usize::from(token >> 4), token & 15);
            if token == SIXTEEN_ZEROS {
                // They may reach beyond the block's end.
                at += 16;
                self.token(&mut before, token);
            } else if at + run < length && size > 0 {
                at += run + 1;
                self.token(&mut before, token);
                let bits = u32::from(choices.byte()) * 0x8101;
                self.number(bits, size);
            }
            if at >= length {
                return;
            }
        }
        self.token(&mut before, END);
    }
}

/// Streams of tokens of these blocks, and how many tokens they have.
fn tokens(choices: &mut Choices<'_>, lengths: impl Iterator<Item = usize>) -> (Vec<u8>, u32) {
    let mut blocks = Blocks {
        apart: choices.chance(128),
        ..Blocks::default()
    };
    let mut dark = 0u32;
    for length in lengths {
        let wanted = match dark {
            0 => match choices.byte() {
                few @ 0..=15 => few,
                many @ 16..=31 => 8 * (many - 15),
                // So many blocks hold nothing.
                some => {
                    dark = u32::from(some - 31) * if some > 240 { 16 } else { 1 };
                    0
                }
            },
            _ => {
                dark -= 1;
                0
            }
        };
        blocks.block(choices, length, wanted);
    }
    if blocks.count > 0 {
        blocks.bits.push(blocks.pending as u8);
    }
    let mut count = if blocks.apart { 3 } else { 1 };
    if choices.chance(16) {
        damage(choices, &mut blocks);
    }
    if choices.rarely() {
        count = choices.byte();
    }
    let all = blocks.tokens.iter().map(Vec::len).sum::<usize>() as u32;
    let mut bytes = vec![count];
    let mut frames = Vec::new();
    for tokens in &blocks.tokens[..usize::from(count).min(3)] {
        let frame = match tokens.is_empty() {
            true => Vec::new(),
            false => frame(choices, tokens),
        };
        let [mut of_tokens, mut of_frame] = [tokens.len() as u32, frame.len() as u32];
        if choices.rarely() {
            (of_tokens, of_frame) = (choices.u32(), choices.u32());
        }
        bytes.extend(of_tokens.to_le_bytes());
        bytes.extend(of_frame.to_le_bytes());
        frames.extend(frame);
    }
    bytes.extend(frames);
    bytes.extend(blocks.bits);
    let claimed = if choices.rarely() { choices.u32() } else { all };
    (bytes, claimed)
}

/// Something that no writer does.
fn damage(choices: &mut Choices<'_>, blocks: &mut Blocks) {
    let stream = usize::from(choices.below(3));
    let tokens = &mut blocks.tokens[stream];
    let at = usize::from(choices.u16()) % tokens.len().max(1);
    match choices.below(7) {
        0 => tokens.truncate(at),
        1 => tokens.insert(at, choices.byte()),
        2 if !tokens.is_empty() => tokens[at] = choices.byte(),
        3 => *tokens = choices.fill(usize::from(choices.0.first().copied().unwrap_or(0))),
        4 => blocks.bits.truncate(at),
        5 => blocks.bits.push(choices.byte()),
        _ => blocks.bits = choices.fill(at),
    }
}

thread_local! {
    static COMPRESSOR: RefCell<zstd::bulk::Compressor<'static>> =
        RefCell::new(zstd::bulk::Compressor::new(1).expect("level 1 is a level"));
}

/// One zstd frame, or rarely what is not quite one.
fn frame(choices: &mut Choices<'_>, plain: &[u8]) -> Vec<u8> {
    let mut frame = COMPRESSOR.with_borrow_mut(|compressor| {
        compressor
            .compress(plain)
            .expect("memory is compressed to memory")
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
        // Of no length that it tells, and a window of its own.
        _ => {
            let level = i32::from(choices.below(19)) + 1;
            frame = zstd::stream::encode_all(plain, level).expect("memory to memory");
        }
    }
    frame
}

/// Header, directory, extensions, metadata, scans.
fn assemble(
    choices: &mut Choices<'_>,
    geometry: &Geometry,
    rank: usize,
    scans: &[Scan],
) -> Vec<u8> {
    let mut directory = Vec::new();
    for scan in scans {
        let coding = match scan.coding {
            Coding::Transform => 1u16,
            Coding::Halves => 2,
            Coding::Direct => 3,
            Coding::DirectHalves => 4,
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
    let plain = |(bytes, plain): &(Vec<u8>, u32)| if bytes.is_empty() { 0 } else { *plain };
    directory.extend(chunks().flat_map(|chunk| plain(chunk).to_le_bytes()));
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
            .expect("memory is compressed to memory")
    });
    let extensions = match choices.rarely() {
        true => choices.up_to(40).to_vec(),
        false => Vec::new(),
    };
    let metadata = match choices.rarely() {
        true => choices.up_to(80).to_vec(),
        false => b"{}".to_vec(),
    };
    let index = [&directory, &extensions, &metadata];
    let parts: usize = scans
        .iter()
        .map(|scan| {
            let chunks = scan.chunks.iter().map(|(bytes, _)| bytes.len());
            scan.basis.len() + chunks.sum::<usize>()
        })
        .sum();
    let bytes = HEADER_BYTES + index.iter().map(|part| part.len()).sum::<usize>() + parts;

    let mut file = b"\xABLTM 10\xBB\r\n\x1A\n\x01\0\0\0".to_vec();
    for side in [
        geometry.camera.width,
        geometry.camera.height,
        geometry.light.width,
        geometry.light.height,
        geometry.window.side(),
        geometry.tile_side,
    ] {
        file.extend(side.to_le_bytes());
    }
    for a in geometry.correspondence.affine.iter().flatten() {
        file.extend(a.to_le_bytes());
    }
    file.extend((bytes as u64).to_le_bytes());
    file.extend((rank as u32).to_le_bytes());
    file.extend((scans.len() as u32).to_le_bytes());
    for part in index {
        file.extend((part.len() as u32).to_le_bytes());
        file.extend(crc32c::crc32c(part).to_le_bytes());
    }
    file.extend([0; 12]);
    file.extend(crc32c::crc32c(&file).to_le_bytes());
    for part in index {
        file.extend(part);
    }
    for scan in scans {
        file.extend(&scan.basis);
        for (bytes, _) in &scan.chunks {
            file.extend(bytes);
        }
    }
    file
}
