"""Section 21 of docs/format.md has the bytes and values of the file that it is about.

    python format_example.py            fails where the text differs
    python format_example.py --print    what the text should have

It needs what format_decoder.py needs.
"""

import sys
from pathlib import Path
from struct import pack, unpack_from

import numpy as np
from format_decoder import G, ZIGZAG, Head, Planes, Tokens, decode, decompress, dot, f32

HERE = Path(__file__).parent
FILE = HERE / "fixtures/format/coarse.ltm"
TEXT = HERE.parent / "docs/format.md"
TILE, SCANS, PIXELS = 3, (1, 2), (0, 15)


def lines_of(data, at, pieces):
    """A dump of `data`, which lies at `at`: a line for each piece of so many bytes."""
    start = at
    for length, what in pieces:
        piece = data[at - start : at - start + length]
        yield f"    {at:04X}  {piece.hex(' ').upper():<28}  {what}"
        at += length
    assert at - start == len(data), "not all that there is"


def directory(head, file):
    content = decompress(file[144 : 144 + head.lengths[0][0]], 4 * (24 + 12 * 6))
    for s in SCANS:
        coding, first, count, _, step, basis_bytes, _ = head.scans[s]
        says = f"scan {s}: coding {coding}, first {first}, count {count}, reserved 0"
        snr = unpack_from("<f", content, 24 * s + 12)[0]
        pieces = [(8, says), (8, f"step {step:.9g}, snr {snr:.4g}")]
        pieces += [(8, f"basis_bytes {basis_bytes}, basis_crc 0")]
        yield from lines_of(content[24 * s : 24 * s + 24], 24 * s, pieces)
    for name, base in ("bytes", 96), ("plain", 192), ("crc", 288):
        for s in SCANS:
            at = base + 4 * (6 * s + TILE)
            value = unpack_from("<I", content, at)[0]
            says = f"{value:08X}" if name == "crc" else value
            yield from lines_of(content[at : at + 4], at, [(4, f"{name}[{s}, {TILE}] = {says}")])


def string(data):
    """What a token string of one stream is made of."""
    tokens, length = unpack_from("<II", data, 1)
    yield from [(1, "streams"), (8, f"{tokens} tokens, in a frame of {length} bytes")]
    yield from [(4, "zstd's magic"), (2, f"descriptor: a single segment; content size {tokens}")]
    yield from [(3, f"block header: the last, raw, of {tokens} bytes"), (tokens, "tokens")]
    if len(data) > 9 + length:
        yield len(data) - 9 - length, "bits"


def chunk(head, s):
    data = head.parts[s][1 + TILE]
    before = sum(map(len, (part for parts in head.parts[:s] for part in parts)))
    at = 144 + sum(length for length, _ in head.lengths) + before
    at += sum(map(len, head.parts[s][: 1 + TILE]))
    pieces = []
    palette = 18 if s == SCANS[0] else 0
    for axis in range(palette // 6):
        values = unpack_from("<3h", data, 6 * axis)
        pieces.append((6, f"palette[{axis}]: " + ", ".join(map(str, values))))
    main = unpack_from("<I", data, palette)[0]
    pieces.append((4, f"main_bytes {main}"))
    end = palette + 4 + main
    pieces += [*string(data[palette + 4 : end]), *string(data[end:])]
    return list(lines_of(data, at, pieces)), data[palette + 4 : end]


def real(value):
    return f"{value:.9g} ({pack('>f', value).hex().upper()})"


def numbers(s, main):
    """Every token of the main string, with its bits in the order in which they come."""
    tokens, block, z = Tokens(main, 100), 0, 0
    for token in tokens.streams[0]:
        says = f"    scan {s}, block {block}: token {token:02X}, "
        if token == 0:
            yield says + "the rest is zero"
            block, z = block + 1, 0
            continue
        zeros, size = divmod(token, 16)
        sign, below, z = tokens.take(1), tokens.take(size - 1), z + zeros
        bits = " ".join([str(sign), *f"{below:0{size - 1}b}"[::-1]][:size])
        value = (2 ** (size - 1) + below) * (-1) ** sign
        yield says + f"bits {bits + ',':<6} z = {z}: {value}"
        z += 1


def transform(head, main):
    """The first pixel of the first block, step by step."""
    step = f32(head.scans[SCANS[0]][4])
    frequencies = np.zeros((8, 8), f32)
    frequencies.reshape(-1)[ZIGZAG] = np.array(Tokens(main, 100).run(64), f32) * step
    for row, column in np.argwhere(frequencies):
        yield f"    F[{row}, {column}]       {real(frequencies[row, column])}"
    partial, pixel = np.zeros(8, f32), f32(0)
    for row in range(8):
        partial += G[row, 0] * frequencies[row]
    for column in range(8):
        pixel += partial[column] * G[column, 0]
    yield f"    partial[0, 0] {real(partial[0])}"
    yield f"    partial[0, 1] {real(partial[1])}"
    yield f"    pixel[0, 0]   {real(pixel)}"


def coefficients(head, file):
    planes = Planes(head.tiles[TILE], head.rank)
    for s in SCANS:
        first, count, step = head.scans[s][1], head.scans[s][2], f32(head.scans[s][4])
        planes.add(head.parts[s][1 + TILE], head.plain[s][TILE], range(first, first + count), step)
    c = decode(file)[0][TILE][0]
    for p in PIXELS:
        y, x = divmod(p, head.tiles[TILE][0])
        q = planes.planes[:, :, y, x]
        length = np.sqrt(dot(c[p, 0], c[p, 0]))
        h = np.array([c[p, 0, 0] - length, c[p, 0, 1], c[p, 0, 2]])
        factor = f32(2) / dot(h, h)
        yield f"    pixel {p}: column {x}, row {y} of the tile"
        yield f"      plane[0, 0]   {real(q[0, 0])}"
        for channel in range(3):
            yield f"      c[0, {channel}]       {real(c[p, 0, channel])}"
        yield f"      plane[1, 0]   {real(q[1, 0])}"
        yield f"      length        {real(length)}"
        yield f"      factor        {real(factor)}"
        yield f"      share         {real(factor * dot(h, q[1]))}"
        for channel in range(3):
            yield f"      c[1, {channel}]       {real(c[p, 1, channel])}"


def main():
    file = FILE.read_bytes()
    head = Head(file)
    chunks = [chunk(head, s) for s in SCANS]
    strings = [main for _, main in chunks]
    written = [line for s, main in zip(SCANS, strings) for line in numbers(s, main)]
    parts = [directory(head, file), *(lines for lines, _ in chunks), written]
    parts += [transform(head, strings[0]), coefficients(head, file)]
    blocks = ["\n".join(line.rstrip() for line in lines) + "\n" for lines in parts]
    if sys.argv[1:] == ["--print"]:
        print("\n".join(blocks), end="")
        return
    text = TEXT.read_text(encoding="utf-8")
    missing = [block for block in blocks if f"\n\n{block}\n" not in text]
    for block in missing:
        print(f"docs/format.md lacks\n{block}")
    print(f"docs/format.md, section 21: {len(blocks) - len(missing)} of {len(blocks)} blocks right")
    sys.exit(bool(missing))


if __name__ == "__main__":
    main()
