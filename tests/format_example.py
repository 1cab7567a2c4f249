"""Tables, listings and test vectors of docs/format.md, computed by format_decoder.py.

    python format_example.py            fails if the document has other figures
    python format_example.py --print    prints what the document should have

It needs what format_decoder.py needs.
"""

import re
import sys
from pathlib import Path
from struct import pack, unpack_from

import format_decoder as decoder
import numpy as np
from format_decoder import FileIndex, Planes, TokenString, decode, decompress, dot, f32

HERE = Path(__file__).parent
DOCUMENT = HERE.parent / "docs/format.md"
TYPE_BYTES = {"u8": 1, "u16": 2, "u32": 4, "u64": 8, "f32": 4, "f64": 8}


def read(name):
    file = (HERE / f"fixtures/format/{name}.ltm").read_bytes()
    return file, FileIndex(file)


def listing(data, at, pieces):
    """Hexadecimal lines of `data`, which is at offset `at`: one for each (length, meaning)."""
    start = at
    for length, meaning in pieces:
        piece = data[at - start : at - start + length]
        yield f"    {at:04X}  {piece.hex(' ').upper():<28}  {meaning}"
        at += length
    assert at - start == len(data), "the pieces have another length than the data"


# Sections 2, 7.1 and 8, appendix A: constants.


def constants():
    crc = decoder.crc32c(b"123456789")
    yield [f"`123456789` is 0x{crc:08X}. A reader MUST check each checksum before it uses the bytes."]
    cosines = [f"{value:.9g}" if value in (0, 1) else str(value) for value in decoder.COSINES]
    cells = enumerate(zip(cosines, decoder.COSINE_BITS.split()))
    cells = [f"| {i} | {cosine} | {bits} |" for i, (cosine, bits) in cells] + ["| | | |"]
    yield [f"{cells[i]} {cells[i + 5]}" for i in range(5)]
    grid = np.argsort(decoder.ZIGZAG).reshape(8, 8)
    yield [f"        {row}    " + "".join(f"{z:4}" for z in line) for row, line in enumerate(grid)]
    yield ["    order = " + ", ".join(map(str, decoder.centre_out_order(3)))]
    side, content = decoder.MAX_SIDE, decoder.MAX_CONTENT_BYTES
    low, high = decoder.TILE_SIDES
    yield [
        f"| camera width and height, light width and height | 1 to {power_of_two(side)} |",
        f"| camera width · height, light width · height | {power_of_two(decoder.MAX_AREA)} |",
        f"| window side | 1 to {decoder.MAX_WINDOW}, odd |",
        f"| tile side | {low} to {high} |",
        f"| tiles | {power_of_two(decoder.MAX_TILES)} |",
        f"| rank | {decoder.MAX_RANK} |",
        f"| scans | {decoder.MAX_SCANS} |",
        f"| extensions | {power_of_two(decoder.MAX_EXTENSION_BYTES)} bytes |",
        f"| control points of a displacement | {power_of_two(decoder.MAX_CONTROL_POINTS)} |",
        f"| metadata | {power_of_two(decoder.MAX_METADATA_BYTES)} bytes |",
        f"| content of a frame other than the directory | {power_of_two(content)} bytes |",
        f"| tokens of a chunk | {power_of_two(content)} |",
        f"| zstd window | {power_of_two(decoder.MAX_WINDOW_BYTES)} bytes |",
        f"| exponent of a basis function | {decoder.MAX_EXPONENT} |",
    ]
    tokens = "3 · `content_bytes` + ⌊`content_bytes` / 256⌋"
    transform, direct = decoder.max_token_bytes(0, True), decoder.max_token_bytes(0, False)
    yield [
        f"   | 1 transform | 1 to 192 · `blocks` · `count` | {transform} + {tokens} |",
        "   | 2, 4 half floats | 6 · P · `count` | bound(`content_bytes`) |",
        f"   | 3 direct | 1 to 3 · P · `count` | {direct} + {tokens} |",
    ]


def power_of_two(value):
    assert value.bit_count() == 1
    return f"2^{value.bit_length() - 1}"


def check_offsets(text):
    """Each field of a table of offsets begins where the field before it ends."""
    tables = re.findall(r"^\| offset \| type .*\n.*\n((?:\|.*\n)+)", text, re.MULTILINE)
    for table in tables:
        at = 0
        for row in table.splitlines():
            offset, kind = [cell.strip() for cell in row.split("|")[1:3]]
            assert int(offset) == at, f"a table of offsets has {offset}, not {at}"
            name, _, count = kind.partition(" x ")
            if kind:
                size = TYPE_BYTES[name] if name in TYPE_BYTES else int(name.removesuffix(" bytes"))
                at += size * int(count or 1)
    assert len(tables) == 6, "other tables of offsets than header, scan record and extensions"


# Appendix H: a whole file.


def whole_file():
    file, index = read("dark")
    lines = []
    for at in range(0, len(file), 16):
        line = file[at : at + 16]
        text = "".join(chr(byte) if 32 <= byte < 127 else "." for byte in line)
        lines.append(f"    {at:04X}  {line.hex(' ').upper():<47}  {text}")
    yield lines
    lengths, crcs = zip(*index.sections)
    sections = [
        f"`{name}_bytes` {length}, checksum {crc:08X}"
        for name, length, crc in zip(("directory", "extension", "metadata"), lengths, crcs)
    ]
    a0, a1, a2, b0, b1, b2 = (f"{a:g}" for a in index.affine)
    yield [
        f"| 0010 | camera {index.width} x {index.height}, light {index.light_width} x "
        f"{index.light_height}, w {index.w}, `tile_side` {index.tile_side} |",
        f"| 0028 | correspondence {a0}, {a1}, {a2}, {b0}, {b1}, {b2} |",
        f"| 0058 | `file_bytes` {len(file)} = 144 + {lengths[0]} + {lengths[1]} + {lengths[2]} |",
        f"| 0060 | r {index.rank}, `scans` {index.scan_count} |",
        f"| 0068 | {sections[0]} |",
        f"| 0070 | {sections[1]} |",
        f"| 0078 | {sections[2]} |",
        "| 0080 | reserved |",
        f"| 008C | header checksum {unpack_from('<I', file, 140)[0]:08X} |",
    ]


# Appendix I: tile 3 of coarse.ltm.

TILE, SCANS, PIXELS = 3, (1, 2), (0, 15)


def directory(index, file):
    tiles, end = len(index.tiles), 144 + index.sections[0][0]
    content = decompress(file[144:end], index.scan_count * (24 + 12 * tiles))
    lines = []
    for s in SCANS:
        coding, first, count, _, step, basis_bytes, _ = index.scans[s]
        record = f"scan {s}: coding {coding}, first {first}, count {count}, reserved 0"
        snr = unpack_from("<f", content, 24 * s + 12)[0]
        pieces = [(8, record), (8, f"step {step:.9g}, snr {snr:.4g}")]
        pieces += [(8, f"basis_bytes {basis_bytes}, basis_crc 0")]
        lines += listing(content[24 * s : 24 * s + 24], 24 * s, pieces)
    for table, name in enumerate(("bytes", "content_bytes", "crc")):
        for s in SCANS:
            at = 24 * index.scan_count + 4 * (tiles * (table * index.scan_count + s) + TILE)
            value = unpack_from("<I", content, at)[0]
            value = f"{value:08X}" if name == "crc" else value
            lines += listing(content[at : at + 4], at, [(4, f"{name}[{s}, {TILE}] = {value}")])
    return lines


def layout(index):
    for s in range(index.scan_count):
        basis, *tiles = map(len, index.chunks[s])
        lengths = f"basis chunk of {basis} bytes, tile chunks of {', '.join(map(str, tiles))}"
        yield f"    {index.offsets[s][0]:04X}  scan {s}: {lengths}"


def token_string(data):
    """The pieces of a token string of one stream, in one raw block."""
    tokens, length = unpack_from("<II", data, 1)
    yield from [(1, "streams"), (8, f"{tokens} tokens, in a frame of {length} bytes")]
    yield from [(4, "zstd's magic number"), (2, f"descriptor: single segment; content size {tokens}")]
    yield from [(3, f"block header: last block, raw, of {tokens} bytes"), (tokens, "tokens")]
    if len(data) > 9 + length:
        yield len(data) - 9 - length, "bits"


def chunk(index, s):
    data = index.chunks[s][1 + TILE]
    klt = 18 if s == SCANS[0] else 0
    pieces = []
    for axis in range(klt // 6):
        values = unpack_from("<3h", data, 6 * axis)
        pieces.append((6, f"klt[{axis}]: " + ", ".join(map(str, values))))
    main = unpack_from("<I", data, klt)[0]
    pieces.append((4, f"main_bytes {main}"))
    end = klt + 4 + main
    pieces += [*token_string(data[klt + 4 : end]), *token_string(data[end:])]
    return list(listing(data, index.offsets[s][1 + TILE], pieces)), data[klt + 4 : end]


def binary32(value):
    return f"{value:.9g} ({pack('>f', value).hex().upper()})"


def bit_list(bits):
    return " ".join(map(str, bits))


def quantised_numbers(s, main, blocks):
    """The tokens of the main token string, with their bits in the order of the bit stream."""
    tokens, lines = TokenString(main, 100), []
    for block in range(blocks):

        def trace(_, token, bits, z, number):
            line = f"    scan {s}, block {block}: token {token:02X}, "
            if bits is None:
                lines.append(line + "all further numbers are zero")
            else:
                lines.append(line + f"bits {bit_list(bits) + ',':<6} z = {z}: {number}")

        tokens.read_run(64, trace)
    return lines


def inverse_dct(index, main):
    """The first pixel of the first block, step by step."""
    step = f32(index.scans[SCANS[0]][4])
    frequencies = np.zeros((8, 8), f32)
    numbers = np.array(TokenString(main, 100).read_run(64), f32)
    frequencies.reshape(-1)[decoder.ZIGZAG] = numbers * step
    for row, column in np.argwhere(frequencies):
        yield f"    F[{row}, {column}]       {binary32(frequencies[row, column])}"
    partial, pixel = np.zeros(8, f32), f32(0)
    for row in range(8):
        partial += decoder.G[row, 0] * frequencies[row]
    for column in range(8):
        pixel += partial[column] * decoder.G[column, 0]
    yield f"    partial[0, 0] {binary32(partial[0])}"
    yield f"    partial[0, 1] {binary32(partial[1])}"
    yield f"    pixel[0, 0]   {binary32(pixel)}"


def colours(index, file):
    planes = Planes(index.tiles[TILE], index.rank)
    for s in SCANS:
        first, count, step = index.scans[s][1], index.scans[s][2], f32(index.scans[s][4])
        components = range(first, first + count)
        planes.add(index.chunks[s][1 + TILE], index.content_bytes[s][TILE], components, step)
    c = decode(file)[0][TILE][0]
    for p in PIXELS:
        y, x = divmod(p, index.tiles[TILE][0])
        q = planes.planes[:, :, y, x]
        length = np.sqrt(dot(c[p, 0], c[p, 0]))
        h = np.array([c[p, 0, 0] - length, c[p, 0, 1], c[p, 0, 2]])
        factor = f32(2) / dot(h, h)
        yield f"    pixel {p}: column {x}, row {y} of the tile"
        yield f"      plane[0, 0]   {binary32(q[0, 0])}"
        for channel in range(3):
            yield f"      c[0, {channel}]       {binary32(c[p, 0, channel])}"
        yield f"      plane[1, 0]   {binary32(q[1, 0])}"
        yield f"      length        {binary32(length)}"
        yield f"      factor        {binary32(factor)}"
        yield f"      scale         {binary32(factor * dot(h, q[1]))}"
        for channel in range(3):
            yield f"      c[1, {channel}]       {binary32(c[p, 1, channel])}"


def tile_of_coding_1():
    file, index = read("coarse")
    chunks = [chunk(index, s) for s in SCANS]
    blocks = len(Planes(index.tiles[TILE], 0).blocks)
    yield directory(index, file)
    yield layout(index)
    yield from (lines for lines, _ in chunks)
    strings = [(s, main) for s, (_, main) in zip(SCANS, chunks)]
    yield [line for s, main in strings for line in quantised_numbers(s, main, blocks)]
    yield inverse_dct(index, chunks[0][1])
    yield colours(index, file)


# Appendix J: the chunk of scan 1 and tile 1 of direct.ltm.


def three_streams():
    file, index = read("direct")
    scan, tile, shown = 1, 1, 16
    data, count = index.chunks[scan][1 + tile], index.scans[scan][2]
    tokens = TokenString(data, index.content_bytes[scan][tile])
    start = index.offsets[scan][1 + tile]
    pieces = [(1, "streams")]
    for i, (number, length) in enumerate(tokens.lengths):
        pieces.append((8, f"stream {i}: {number} tokens, in a frame of {length} bytes"))
    lines = list(listing(data[:25], start, pieces))
    at = 25
    for i, (number, length) in enumerate(tokens.lengths):
        meaning = f"frame of stream {i}, its first 8 of {length} bytes"
        lines += listing(data[at : at + 8], start + at, [(8, meaning)])
        at += length
    meaning = f"bits, the first 8 of {len(data) - at} bytes"
    yield lines + list(listing(data[at : at + 8], start + at, [(8, meaning)]))
    first = [content[:shown].hex(" ").upper() for content in tokens.contents]
    yield [f"    stream {i}  {content} ..." for i, content in enumerate(first)]

    lines = []

    def trace(context, token, bits, at, number):
        line = f"    stream {context}: token {token:02X}"
        if token == 0xF0:
            lines.append(line + f"{'':12}sixteen zeros, numbers {at} to {at + 15}")
        elif bits is None:
            lines.append(line + f"{'':12}numbers {at} to {3 * count - 1} are zero")
        else:
            lines.append(line + f", bits {bit_list(bits):<7}  number {at} is {number}")

    numbers = np.array(tokens.read_run(3 * count, trace)).reshape(-1, 3)
    yield lines

    lines = []
    order, step = decoder.centre_out_order(index.w), f32(index.scans[scan][4])
    before, after = (decode(file, scans)[0][tile][1] for scans in (scan, scan + 1))
    for item in (0, 2):
        slot, colour = order[item], decoder.colours_of(numbers[item])
        y_co_cg, rgb = (", ".join(map(str, values)) for values in (numbers[item], colour))
        lines.append(f"    item {item}, slot {slot}: Y, Co, Cg = {y_co_cg}; red, green, blue = {rgb}")
        for channel, number in enumerate(colour):
            old, new = before[0, slot, channel], after[0, slot, channel]
            assert new == old + f32(number) * step
            sum_text = f"{binary32(old)} + {number} · step = {binary32(new)}"
            lines.append(f"      d[0, {slot}, {channel}] = {sum_text}")
    yield lines


# Appendix K: mixed.ltm. tests/conformance.rs computes the same lines with the library.

WINDOW_PIXELS = [(0, 0), (5, 1), (5, 8), (12, 3), (19, 9)]
PIXEL, SLOTS = (5, 8), (2, 3, 14)
ELEMENTS = [(0, 0), (1, 2), (7, 4)]
EXPOSURE = 1 / 16


def image_codes(u, v):
    return 255 - 32 * u, 60 * v, 15 + 16 * (u + v)


def reals(values):
    return " ".join(f"{value:.6f}" for value in values)


def tile_and_pixel(index, x, y):
    side = index.tile_side
    tile = y // side * -(-index.width // side) + x // side
    return tile, y % side * index.tiles[tile][0] + x % side


def picture(index, tiles, basis):
    emissions = [
        [decoder.emission_of_code(code) for code in image_codes(u, v)]
        for v in range(index.light_height)
        for u in range(index.light_width)
    ]
    result = np.zeros((index.height, index.width, 3))
    for y, x in np.ndindex(index.height, index.width):
        tile, p = tile_and_pixel(index, x, y)
        c, d = tiles[tile]
        tau = decoder.unmasked_function(c[p], d[p], basis)
        origin = decoder.window_origin(index, x, y)
        for slot, values in enumerate(tau):
            m = decoder.element_of_slot(index, origin, slot)
            if m is not None:
                result[y, x] += values * emissions[m]
    return result


def facts():
    """Sentences with figures of the fixtures. Line breaks do not matter."""
    for name in "transform", "coarse", "direct", "mixed", "lossless", "extended", "dark":
        _, index = read(name)
        sides = f"{index.width} x {index.height} | {index.tile_side} | {index.w} | {index.rank}"
        yield f"| `{name}` | {sides} |"

    file, index = read("dark")
    yield f"This is all of `dark.ltm`, {len(file)} bytes without light:"

    _, index = read("coarse")
    columns, rows = index.tiles[TILE]
    blocks = len(Planes((columns, rows), 0).blocks)
    left, top = index.corners[TILE]
    tiles, side = len(index.tiles), index.tile_side
    grid = f"{-(-index.width // side)} x {-(-index.height // side)}"
    content_bytes = index.scan_count * (24 + 12 * tiles)
    yield f"This is tile {TILE} of `coarse.ltm`"
    yield (
        f"camera {index.width} x {index.height}, w = {index.w}, `tile_side` {side}, r = {index.rank}, "
        f"{index.scan_count} scans. There are {grid} tiles, and tile {TILE} is the left one of the "
        f"lower row: columns {left} to {left + columns - 1} and rows {top} to {top + rows - 1}, so P = "
        f"{columns * rows} pixels in `blocks` = {blocks} blocks"
    )
    yield (
        f"The frame at {144:04X} decompresses to {index.scan_count} · (24 + 12 · {tiles}) = "
        f"{content_bytes} bytes"
    )
    yield f"The file index has {index.index_bytes} bytes, {index.index_bytes:04X} in hexadecimal."
    offsets = index.offsets[SCANS[0]]
    before = " + ".join(str(index.bytes[SCANS[0]][tile]) for tile in range(TILE))
    yield (
        f"begins {before} bytes after {offsets[0]:04X}, at {offsets[1 + TILE]:04X}, and that of scan "
        f"{SCANS[1]} at {index.offsets[SCANS[1]][1 + TILE]:04X}."
    )
    main, side = chunk_strings(index, SCANS[0])
    total = index.content_bytes[SCANS[0]][TILE]
    yield f"The tokens of both strings are {main.count} + {side.count} = {total}, which"

    _, index = read("direct")
    columns, rows = index.tiles[1]
    _, first, count, *_ = index.scans[1]
    yield f"`first` = {first} and `count` = {count}: all slots of a window with w = {index.w}."
    yield (
        f"The tile has {columns} x {rows} = {columns * rows} pixels, each with a run of {3 * count} "
        f"numbers. So stream 0, which has the first token of each run, has {columns * rows} tokens."
    )

    _, index = read("mixed")
    a0, a1, a2, b0, b1, b2 = index.affine
    assert a1 == b0 == 0
    yield (
        f"camera {index.width} x {index.height}, light plane {index.light_width} x "
        f"{index.light_height}, w = {index.w}, r = {index.rank}, the correspondence u = {a0:g} · (x + 0.5) - {-a2:g}, "
        f"v = {b1:g} · (y + 0.5) - {-b2:g}."
    )
    tile, p = tile_and_pixel(index, *PIXEL)
    yield f"Pixel {PIXEL} is pixel {p} of tile {tile},"


def chunk_strings(index, s):
    data, first = index.chunks[s][1 + TILE], index.scans[s][1]
    return Planes(index.tiles[TILE], index.rank).split(data, index.content_bytes[s][TILE], [first])


def windows_to_picture():
    file, index = read("mixed")
    tiles, basis = decode(file)

    lines = []
    for x, y in WINDOW_PIXELS:
        u, v = (a * (x + 0.5) + b * (y + 0.5) + c for a, b, c in np.reshape(index.affine, (2, 3)))
        origin = decoder.window_origin(index, x, y)
        lines.append(f"    pixel ({x}, {y}): u {u:.2f}, v {v:.2f}, origin ({origin[0]}, {origin[1]})")
    yield lines

    (x, y), origin = PIXEL, decoder.window_origin(index, *PIXEL)
    elements = [decoder.element_of_slot(index, origin, slot) for slot in range(index.w**2)]
    lines = []
    for first in range(0, index.w**2, index.w):
        row = elements[first : first + index.w]
        row = "".join("   -" if m is None else f"{m:4}" for m in row)
        lines.append(f"    slots {first:2} to {first + index.w - 1:2}:{row}")
    yield lines

    tile, p = tile_and_pixel(index, x, y)
    c, d = (values[p] for values in tiles[tile])
    lines = [f"    c[{k}]  {reals(c[k])}" for k in range(index.rank)]
    tau = decoder.unmasked_function(c, d, basis)
    for slot in SLOTS:
        is_off = elements[slot] is None
        place = "off the light plane" if is_off else f"element {elements[slot]}"
        lines.append(f"    slot {slot}, {place}")
        lines.append(f"      v[0], v[1], v[2]  {reals(basis[:, slot])}")
        lines.append(f"      d                 {reals(d[slot])}")
        lines.append(f"      d + Σ c · v       {reals(tau[slot])}")
        lines.append(f"      τ                 {reals(np.zeros(3) if is_off else tau[slot])}")
    yield lines

    lines = []
    for u, v in ELEMENTS:
        codes = image_codes(u, v)
        m = v * index.light_width + u
        emission = reals(map(decoder.emission_of_code, codes))
        lines.append(f"    element {m}: codes {' '.join(map(str, codes))}, light {emission}")
    yield lines

    values = picture(index, tiles, basis)
    yield [f"    pixel ({x}, {y}): {reals(values[y, x])}"]
    for channel in range(3):
        yield [
            "    " + " ".join(f"{decoder.code_of_light(value * EXPOSURE):3}" for value in row)
            for row in values[:, :, channel]
        ]


def main():
    sections = {
        "constants": constants,
        "appendix H": whole_file,
        "appendix I": tile_of_coding_1,
        "appendix J": three_streams,
        "appendix K": windows_to_picture,
    }
    text = DOCUMENT.read_text(encoding="utf-8")
    missing = 0
    for name, section in sections.items():
        blocks = ["\n".join(line.rstrip() for line in lines) + "\n" for lines in section()]
        if sys.argv[1:] == ["--print"]:
            print(f"{name}\n\n" + "\n".join(blocks))
            continue
        lacking = [block for block in blocks if f"\n{block}" not in text]
        for block in lacking:
            print(f"docs/format.md lacks\n{block}")
        print(f"docs/format.md, {name}: {len(blocks) - len(lacking)} of {len(blocks)} blocks match")
        missing += len(lacking)
    if sys.argv[1:] != ["--print"]:
        check_offsets(text)
        words = " ".join(text.split())
        for fact in facts():
            if fact not in words:
                print(f"docs/format.md lacks: {fact}")
                missing += 1
    sys.exit(bool(missing))


if __name__ == "__main__":
    main()
