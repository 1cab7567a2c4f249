"""An independent decoder of .ltm files, written from docs/format.md alone: the test of that text.

    python format_decoder.py FILE.ltm...            compares each with FILE.expected.zst, bit for bit
    python format_decoder.py --dump FILE.ltm OUT    writes what would be compared

It needs Python 3.10, numpy and zstandard. Sections are those of the text.
"""

import json
import math
import sys
from pathlib import Path
from struct import unpack_from

import numpy as np
import zstandard

f32 = np.float32
MOST = 1 << 23


class Refused(Exception):
    pass


def require(condition, what):
    if not condition:
        raise Refused(what)


def crc_of_byte(crc):
    for _ in range(8):
        crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc


CRC_TABLE = [crc_of_byte(byte) for byte in range(256)]


def crc32c(data):  # section 2
    crc = 0xFFFFFFFF
    for byte in data:
        crc = CRC_TABLE[(crc ^ byte) & 0xFF] ^ crc >> 8
    return crc ^ 0xFFFFFFFF


def bound(n):  # section 8
    return n + n // 256 + 64


def decompress(frame, length):  # section 8
    require(frame[:4] == b"\x28\xb5\x2f\xfd", "no zstd frame")
    try:
        said = zstandard.get_frame_parameters(frame)
        require(frame[4] & 0x20 or said.window_size <= MOST, "a zstd window that is too large")
        require(said.dict_id == 0, "a zstd dictionary")
        decoder = zstandard.ZstdDecompressor(max_window_size=1 << 31).decompressobj()
        content = decoder.decompress(frame)
    except zstandard.ZstdError as error:
        raise Refused(error) from None
    require(decoder.eof and not decoder.unused_data, "not one zstd frame")
    require(len(content) == length, "a frame of another length")
    return content


class Head:
    def __init__(self, file):
        self.read_header(file)
        at, parts = 144, []
        for length, crc in self.lengths:
            parts.append(file[at : at + length])
            require(crc32c(parts[-1]) == crc, "a wrong checksum in the head")
            at += length
        self.read_directory(parts[0])
        read_extensions(parts[1])
        read_metadata(parts[2])
        self.take_parts(file, at)

    def read_header(self, file):  # section 4
        require(file[:12] == b"\xabLTM 10\xbb\r\n\x1a\n", "a wrong magic")
        require(len(file) >= 144, "cut short")
        require(unpack_from("<H", file, 12)[0] == 1, "another major version")
        require(crc32c(file[:140]) == unpack_from("<I", file, 140)[0], "a wrong header checksum")
        *sides, self.w, tile_side = unpack_from("<6I", file, 16)
        require(all(1 <= side <= 32768 for side in sides), "the side of a grid")
        require(self.w % 2 == 1 and self.w <= 63, "the window's side")
        require(8 <= tile_side <= 256, "the tile side")
        require(all(map(math.isfinite, unpack_from("<6d", file, 40))), "the correspondence")
        file_bytes, self.rank, self.scan_count = unpack_from("<QII", file, 88)
        fields = unpack_from("<6I", file, 104)
        self.lengths = list(zip(fields[::2], fields[1::2]))
        require(self.rank <= 1024 and self.scan_count <= 1024, "too high a rank, or too many scans")
        require(fields[2] <= 1 << 24 and fields[4] <= 1 << 20, "long extensions or metadata")
        require(144 + sum(fields[::2]) <= file_bytes == len(file), "a file of another length")
        corners = [range(0, side, tile_side) for side in sides[1::-1]]
        width, height = sides[:2]
        self.tiles = [  # columns and rows
            (min(tile_side, width - x), min(tile_side, height - y))
            for y in corners[0]
            for x in corners[1]
        ]

    def read_directory(self, frame):  # section 5
        scans, tiles, area = self.scan_count, len(self.tiles), self.w**2
        plain = decompress(frame, scans * (24 + 12 * tiles))
        self.scans = [unpack_from("<4Hf4xII", plain, 24 * s) for s in range(scans)]
        self.brought, known = [], 0
        for coding, first, count, reserved, step, basis_bytes, _ in self.scans:
            require(1 <= coding <= 4 and count > 0 and reserved == 0, "a scan")
            require(0 < step < math.inf, "a step")
            end = first + count
            brings = max(0, end - known) if coding <= 2 else 0
            require(end <= area if coding > 2 else first <= known and end <= self.rank, "a scan")
            most = bound(brings * (1 + 2 * area)) if brings else 0
            require((brings > 0) <= basis_bytes <= most, "functions of a strange length")
            known += brings
            self.brought.append(brings)
        require(known == self.rank, "a basis that does not come")
        codings = {scan[0] for scan in self.scans}
        require(not {1, 2} <= codings and not {3, 4} <= codings, "mixed codings")
        fields = np.frombuffer(plain, "<u4", offset=24 * scans).reshape(3, scans, tiles)
        self.bytes, self.plain, self.crc = fields.tolist()
        for scan, lengths, plains in zip(self.scans, self.bytes, self.plain):
            for tile, length, size in zip(self.tiles, lengths, plains):
                fits = can_be(scan[0], scan[2], tile, length, size) if length else size == 0
                require(fits, "a chunk of a strange length")

    def take_parts(self, file, at):  # section 3
        self.parts = []
        for scan, lengths, crcs in zip(self.scans, self.bytes, self.crc):
            self.parts.append([])
            for length, crc in zip([scan[5], *lengths], [scan[6], *crcs]):
                part = file[at : at + length]
                require(length == 0 or crc32c(part) == crc, "a wrong checksum of a part")
                self.parts[-1].append(part)
                at += length
        require(at == len(file), "parts that do not add up")


def can_be(coding, count, tile, length, plain):  # section 5
    columns, rows = tile
    halves = 6 * columns * rows * count
    blocks = -(-columns // 8) * -(-rows // 8)
    low, high, most = {
        1: (1, 192 * blocks * count, 584 + 3 * plain + plain // 256),
        3: (1, halves // 2, 281 + 3 * plain + plain // 256),
    }.get(coding, (halves, halves, bound(plain)))
    return low <= plain <= min(high, MOST) and length <= most


def read_extensions(data):  # section 6
    at = 0
    while at < len(data):
        require(at + 12 <= len(data), "a cut extension")
        tag, flags, length = unpack_from("<4sII", data, at)
        require(not flags & 1, f"an extension that must be understood: {tag}")
        at += 12 + length
        require(at <= len(data), "a cut extension")


def read_metadata(data):  # section 7
    class Pairs(list):
        pass

    def fits(value, types):
        if not isinstance(value, Pairs):
            return False
        known = [(types[name](field), name) for name, field in value if name in types]
        return len(known) == len(set(known)) and all(right for right, _ in known)

    def integer(value):
        return type(value) is int

    def whole(text):
        return int(text) if text[0] != "-" else None

    def no_number(name):
        raise ValueError(name)

    strings = ["title", "creator", "rights", "writer", "method", "units"]
    types = dict.fromkeys(strings, lambda value: isinstance(value, str))
    counts = {"patterns": integer, "photographs": integer}
    types["capture"] = lambda value: fits(value, counts)
    types["shots_used"] = lambda value: type(value) is list and all(map(integer, value))
    try:
        decoder = json.JSONDecoder(
            object_pairs_hook=Pairs, parse_int=whole, parse_constant=no_number
        )
        value = decoder.decode(data.decode())
    except (ValueError, RecursionError) as error:
        raise Refused(error) from None
    require(fits(value, types), "metadata of another form")


def join(planes, kind):
    return np.frombuffer(planes, np.uint8).reshape(2, -1).T.copy().view(kind).reshape(-1)


def read_basis(part, functions, area):  # section 9
    plain = decompress(part, functions * (1 + 2 * area))
    exponents = np.frombuffer(plain[:functions], np.uint8)
    require(exponents.max() <= 30, "an exponent")
    code = join(plain[functions:], "<u2").astype(int).reshape(functions, area)
    number = np.where(code % 2 == 0, code >> 1, -(code >> 1) - 1)
    return (number / 2.0 ** exponents[:, None]).astype(f32)


class Tokens:  # section 10
    def __init__(self, data, most):
        require(data[:1] in (b"\1", b"\3"), "a strange number of token streams")
        at = 1 + 8 * data[0]
        require(at <= len(data), "a cut token string")
        lengths = [unpack_from("<II", data, 1 + 8 * i) for i in range(data[0])]
        self.count = sum(tokens for tokens, _ in lengths)
        require(self.count <= most, "too many tokens")
        self.streams = []
        for tokens, length in lengths:
            require(at + length <= len(data), "a cut token string")
            frame = data[at : at + length]
            self.streams.append(iter(decompress(frame, tokens) if tokens or frame else b""))
            at += length
        self.bits, self.taken = int.from_bytes(data[at:], "little"), 0
        self.most_bits = 8 * (len(data) - at)

    def take(self, count):
        bits = self.bits >> self.taken & (1 << count) - 1
        self.taken += count
        require(self.taken <= self.most_bits, "too few bits")
        return bits

    def run(self, length):
        numbers = [0] * length
        at = stream = 0
        while at < length:
            token = next(self.streams[stream if len(self.streams) > 1 else 0], None)
            require(token is not None, "too few tokens")
            stream = 1 if token % 16 <= 1 else 2
            if token == 0:
                break
            if token == 0xF0:
                at += 16
                continue
            size = token % 16
            at += token >> 4
            require(size > 0 and at < length, "a token that cannot be")
            sign = self.take(1)
            magnitude = (1 << size - 1) + self.take(size - 1)
            numbers[at] = -magnitude if sign else magnitude
            at += 1
        return numbers

    def finish(self):
        require(all(next(stream, None) is None for stream in self.streams), "tokens left over")
        require(self.most_bits - self.taken < 8 and not self.bits >> self.taken, "bits left over")


# Section 11.
BITS = "3F800000 3F7B14BE 3F6C835E 3F54DB31 3F3504F3 3F0E39DA 3EC3EF15 3E47C5C2 00000000"
CONSTANT = np.frombuffer(bytes.fromhex(BITS), ">f4").astype(f32)


def cosine(f, x):
    turn = (2 * x + 1) * f % 32
    turn = 32 - turn if turn > 16 else turn
    value = CONSTANT[turn] if turn <= 8 else -CONSTANT[16 - turn]
    return f32(0.5) * (CONSTANT[4] if f == 0 else value)


G = np.array([[cosine(f, x) for x in range(8)] for f in range(8)], f32)
ZIGZAG = [
    8 * row + total - row
    for total in range(15)
    for row in (range(total, -1, -1) if total % 2 == 0 else range(total + 1))
    if row < 8 and total - row < 8
]


def inverse_transform(numbers, step):
    f, partial, pixels = (np.zeros((8, 8), f32) for _ in range(3))
    f.reshape(-1)[ZIGZAG] = np.array(numbers, f32) * step
    for row in range(8):
        partial += G[row][:, None] * f[row]
    for column in range(8):
        pixels += partial[:, column : column + 1] * G[column]
    return pixels


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


class Planes:
    def __init__(self, tile, rank):
        columns, rows = tile
        self.planes = np.zeros((rank, 3, rows, columns), f32)
        self.blocks = [(y, x) for y in range(0, rows, 8) for x in range(0, columns, 8)]
        self.present, self.palette = [False] * rank, None

    def add(self, chunk, plain, components, step):
        if components[0] == 0 and self.palette is None:
            require(len(chunk) >= 18, "a cut palette")
            self.palette = np.frombuffer(chunk[:18], "<i2").reshape(3, 3)
            chunk = chunk[18:]
        require(len(chunk) >= 4, "a cut chunk")
        end = 4 + unpack_from("<I", chunk)[0]
        require(end <= len(chunk), "a cut chunk")
        main = Tokens(chunk[4:end], plain)
        side = Tokens(chunk[end:], plain - main.count)
        require(main.count + side.count == plain, "fewer tokens than it says")
        for tokens, axes in (main, [0]), (side, [1, 2]):
            for k in components:
                for y, x in self.blocks:
                    numbers = tokens.run(64 * len(axes))
                    self.present[k] |= any(numbers)
                    for i, axis in enumerate(axes):
                        pixels = inverse_transform(numbers[i :: len(axes)], step)
                        inside = self.planes[k, axis, y : y + 8, x : x + 8]
                        inside += pixels[: inside.shape[0], : inside.shape[1]]
            tokens.finish()

    def coefficients(self):
        rank = len(self.present)
        planes = self.planes.reshape(rank, 3, -1)
        c = np.zeros_like(planes)
        if self.present[0]:
            unit = self.palette.astype(f32) / f32(16384)
            for channel in range(3):
                c[0, channel] = dot(planes[0], unit[:, channel])
        red, green, blue = c[0]
        h = np.stack([red - np.sqrt(dot(c[0], c[0])), green, blue])
        square = dot(h, h)
        normal = np.isfinite(square) & (square >= np.finfo(f32).tiny)
        h, factor = np.where(normal, h, f32(0)), np.where(normal, f32(2) / square, f32(0))
        for k in range(1, rank):
            if self.present[k]:
                c[k] = planes[k] - factor * dot(h, planes[k]) * h
        return c.transpose(2, 0, 1)


def add_halves(values, items, chunk, step):  # section 12
    halves = join(decompress(chunk, 6 * len(values) * len(items)), "<f2")
    require(np.isfinite(halves).all(), "a value that is no finite number")
    halves = halves.reshape(len(items), 3, -1).transpose(2, 0, 1)
    values[:, items] += halves.astype(f32) * step


def slot_order(w):  # section 13
    def distance(slot):
        return (slot % w - w // 2) ** 2 + (slot // w - w // 2) ** 2

    return sorted(range(w * w), key=lambda slot: (distance(slot), slot))


def add_direct(values, slots, chunk, plain, step):  # section 13
    tokens = Tokens(chunk, plain)
    require(tokens.count == plain, "fewer tokens than it says")
    numbers = np.array([tokens.run(3 * len(slots)) for _ in values]).reshape(-1, len(slots), 3)
    tokens.finish()
    luma, orange, greenish = numbers.transpose(2, 0, 1)
    middle = luma - (greenish >> 1)
    blue = middle - (orange >> 1)
    colours = np.stack([blue + orange, greenish + middle, blue], axis=-1)
    values[:, slots] += colours.astype(f32) * step


@np.errstate(all="ignore")  # what is not normal is mirrored in vain, and large steps overflow
def decode(file):  # section 14
    """c and d of each tile, and the basis."""
    head = Head(file)
    area, order = head.w**2, slot_order(head.w)
    basis = [np.zeros((0, area), f32)]
    for parts, functions in zip(head.parts, head.brought):
        if functions:
            basis.append(read_basis(parts[0], functions, area))
    tiles = []
    for t, tile in enumerate(head.tiles):
        planes, pixels = Planes(tile, head.rank), tile[0] * tile[1]
        c, d = (np.zeros((pixels, each, 3), f32) for each in (head.rank, area))
        for s, (coding, first, count, _, step, _, _) in enumerate(head.scans):
            chunk, plain = head.parts[s][1 + t], head.plain[s][t]
            items, step = range(first, first + count), f32(step)
            if not chunk:
                continue
            if coding == 1:
                planes.add(chunk, plain, items, step)
            elif coding == 2:
                add_halves(c, items, chunk, step)
            elif coding == 3:
                add_direct(d, [order[place] for place in items], chunk, plain, step)
            else:
                add_halves(d, [order[place] for place in items], chunk, step)
        tiles.append((planes.coefficients() if any(planes.present) else c, d))
    return tiles, np.concatenate(basis)


def dump(file):  # section 19
    tiles, basis = decode(file)
    values = [value for tile in tiles for value in tile] + [basis]
    return b"".join(np.ascontiguousarray(value, "<f4").tobytes() for value in values)


def check(path):
    try:
        got = np.frombuffer(dump(path.read_bytes()), "<u4")
    except Refused as refused:
        print(f"{path.name}: refused for {refused}")
        return False
    expected = zstandard.decompress(path.with_suffix(".expected.zst").read_bytes())
    expected = np.frombuffer(expected, "<u4")
    if len(got) != len(expected):
        print(f"{path.name}: {len(got)} values, not {len(expected)}")
        return False
    wrong = np.count_nonzero(got != expected)
    print(f"{path.name}: {len(got)} values, " + (f"{wrong} DIFFER" if wrong else "all the same"))
    return wrong == 0


def main(arguments):
    match arguments:
        case ["--dump", file, out]:
            Path(out).write_bytes(dump(Path(file).read_bytes()))
        case [] | ["--dump", *_]:
            sys.exit(__doc__)
        case files:
            sys.exit(not all([check(Path(file)) for file in files]))


if __name__ == "__main__":
    main(sys.argv[1:])
