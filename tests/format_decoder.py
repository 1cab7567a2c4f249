"""An independent decoder of .ltm files, written from docs/format.md alone: the test of that document.

    python format_decoder.py FILE.ltm...            compares each with FILE.expected.zst, bit for bit
    python format_decoder.py --dump FILE.ltm OUT    writes the decoded values

It needs Python 3.10, numpy and zstandard. Sections and appendices are those of the document.
"""

import json
import math
import sys
from pathlib import Path
from struct import unpack_from

import numpy as np
import zstandard

f32 = np.float32

# Appendix A.
MAX_SIDE = 1 << 20
MAX_AREA = 1 << 36
MAX_TILES = 1 << 24
MAX_WINDOW = 63
TILE_SIDES = 8, 256
MAX_RANK = MAX_SCANS = 1024
MAX_EXTENSION_BYTES = 1 << 24
MAX_METADATA_BYTES = 1 << 20
MAX_COLOR_FACTOR = 1000
MAX_CONTENT_BYTES = MAX_WINDOW_BYTES = 1 << 23
MAX_EXPONENT = 30
SPACINGS = 8, 4096
MAX_CONTROL_POINTS = 1 << 20
MAX_LEVELS = 14
SHARD_SIDES = 256, 4096


class Refused(Exception):
    """The file breaks a rule of appendix A."""


def require(condition, fault):
    if not condition:
        raise Refused(fault)


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


def bound(length):  # appendix A
    return length + length // 256 + 64


def decompress(frame, length):  # section 4, appendix A
    require(frame[:4] == b"\x28\xb5\x2f\xfd", "bytes that are no zstd frame")
    try:
        header = zstandard.get_frame_parameters(frame)
        is_single_segment = frame[4] & 0x20
        require(is_single_segment or header.window_size <= MAX_WINDOW_BYTES, "a large zstd window")
        require(header.dict_id == 0, "a zstd dictionary")
        decoder = zstandard.ZstdDecompressor(max_window_size=1 << 31).decompressobj()
        content = decoder.decompress(frame)
    except zstandard.ZstdError as error:
        raise Refused(error) from None
    require(decoder.eof and not decoder.unused_data, "bytes that are not one zstd frame")
    require(len(content) == length, "a frame whose content has another length")
    return content


class FileIndex:
    """Header and directory, checked, and the bytes of all chunks."""

    def __init__(self, file):
        self.read_header(file)
        at, sections = 144, []
        for length, crc in self.sections:
            sections.append(file[at : at + length])
            require(crc32c(sections[-1]) == crc, "a checksum of the index that does not match")
            at += length
        self.index_bytes = at
        self.read_directory(sections[0])
        self.read_extensions(sections[1])
        read_metadata(sections[2])
        self.take_chunks(file)

    def read_header(self, file):  # section 3.1
        require(file[:12] == b"\xabLTM 10\xbb\r\n\x1a\n", "another magic number")
        require(len(file) >= 144, "a header that is cut short")
        require(unpack_from("<H", file, 12)[0] == 1, "another major version")
        crc = unpack_from("<I", file, 140)[0]
        require(crc32c(file[:140]) == crc, "a header whose checksum does not match")
        *sides, self.w, self.tile_side = unpack_from("<6I", file, 16)
        require(all(1 <= side <= MAX_SIDE for side in sides), "a side of the camera or light grid")
        require(self.w % 2 == 1 and self.w <= MAX_WINDOW, "the side of the window")
        require(TILE_SIDES[0] <= self.tile_side <= TILE_SIDES[1], "the side of tiles")
        self.width, self.height, self.light_width, self.light_height = sides
        self.affine = unpack_from("<6d", file, 40)
        require(all(map(math.isfinite, self.affine)), "a correspondence that is not finite")
        file_bytes, self.rank, self.scan_count = unpack_from("<QII", file, 88)
        fields = unpack_from("<6I", file, 104)
        self.sections = list(zip(fields[::2], fields[1::2]))
        require(self.rank <= MAX_RANK and self.scan_count <= MAX_SCANS, "the rank or number of scans")
        require(fields[2] <= MAX_EXTENSION_BYTES, "the length of extensions")
        require(fields[4] <= MAX_METADATA_BYTES, "the length of the metadata")
        require(144 + sum(fields[::2]) <= file_bytes == len(file), "the length of the file")
        areas = self.width * self.height, self.light_width * self.light_height
        require(max(areas) <= MAX_AREA, "the number of pixels or light elements")
        side = self.tile_side
        tiles = -(-self.width // side) * -(-self.height // side)
        require(tiles <= MAX_TILES, "the number of tiles")
        self.corners = [
            (x, y) for y in range(0, self.height, side) for x in range(0, self.width, side)
        ]
        self.tiles = [  # columns and rows
            (min(side, self.width - x), min(side, self.height - y)) for x, y in self.corners
        ]

    def read_extensions(self, data):  # sections 3.3, 3.4 and 12
        """The displacement, the table of levels and the place of a shard, each if there is one."""
        known, at = {}, 0
        while at < len(data):
            require(at + 12 <= len(data), "an extension that is cut short")
            tag, flags, length = unpack_from("<4sII", data, at)
            at += 12 + length
            require(at <= len(data), "an extension that is cut short")
            if tag in (b"DISP", b"LEVL", b"SHRD"):
                require(tag not in known, f"two extensions {tag}")
                known[tag] = data[at - length : at]
            else:
                require(not flags & 1, f"an extension that must be understood: {tag}")
        place = known.get(b"SHRD")
        require(place is None or len(place) == 28, "the place of a shard")
        self.place = place and unpack_from("<7I", place)
        _, self.first_x, self.first_y, self.first_u, self.first_v, *plane = self.place or [0] * 7
        own = (self.first_u + self.light_width, self.first_v + self.light_height)
        is_within = not place or all(end <= side for end, side in zip(own, plane))
        require(is_within, "the light plane of a shard")
        self.table = known.get(b"LEVL")
        self.displacement = None
        if b"DISP" in known:
            self.displacement = self.read_displacement(known[b"DISP"])

    def read_displacement(self, data):  # sections 3.4 and 12
        """Spacing, step, and codes `[axis, row, column]`."""
        require(len(data) >= 8, "a displacement that is cut short")
        spacing, step = unpack_from("<H2xf", data)
        require(SPACINGS[0] <= spacing <= SPACINGS[1], "the spacing of control points")
        require(0 < step < math.inf, "the step of a displacement")
        width, height = self.first_x % spacing + self.width, self.first_y % spacing + self.height
        columns, rows = (-(-side // spacing) + 1 for side in (width, height))
        require(columns * rows <= MAX_CONTROL_POINTS, "too many control points")
        number = join_bytes(decompress(data[8:], 4 * columns * rows), "<u2").astype(int)
        difference = np.where(number % 2 == 0, number >> 1, -(number >> 1) - 1)
        codes = np.cumsum(difference.reshape(2, rows, columns), axis=2)
        return spacing, float(step), (codes + 32768) % 65536 - 32768

    def read_directory(self, frame):  # section 3.2
        scans, tiles, area = self.scan_count, len(self.tiles), self.w**2
        content = decompress(frame, scans * (24 + 12 * tiles))
        self.scans = [unpack_from("<4Hf4xII", content, 24 * s) for s in range(scans)]
        self.new_functions, known = [], 0
        for coding, first, count, reserved, step, basis_bytes, _ in self.scans:
            require(1 <= coding <= 4 and count > 0 and reserved == 0, "a scan record")
            require(0 < step < math.inf, "a step")
            end = first + count
            new = max(0, end - known) if coding <= 2 else 0
            fits = end <= area if coding > 2 else first <= known and end <= self.rank
            require(fits, "a scan of other components or slots than the file has")
            max_bytes = bound(new * (1 + 2 * area)) if new else 0
            require((new > 0) <= basis_bytes <= max_bytes, "the length of a basis chunk")
            known += new
            self.new_functions.append(new)
        require(known == self.rank, "basis functions that no scan brings")
        codings = {scan[0] for scan in self.scans}
        require(not {1, 2} <= codings and not {3, 4} <= codings, "mixed codings")
        fields = np.frombuffer(content, "<u4", offset=24 * scans).reshape(3, scans, tiles)
        self.bytes, self.content_bytes, self.crc = fields.tolist()
        for scan, lengths, contents in zip(self.scans, self.bytes, self.content_bytes):
            for tile, length, content in zip(self.tiles, lengths, contents):
                valid = is_valid_entry(scan[0], scan[2], tile, length, content)
                require(valid if length else content == 0, "the lengths of a tile chunk")

    def take_chunks(self, file):  # section 3: [scan][0] basis chunk, [scan][1 + tile] tile chunk
        self.chunks, self.offsets, at = [], [], self.index_bytes
        for scan, lengths, crcs in zip(self.scans, self.bytes, self.crc):
            self.chunks.append([])
            self.offsets.append([])
            for length, crc in zip([scan[5], *lengths], [scan[6], *crcs]):
                chunk = file[at : at + length]
                require(length == 0 or crc32c(chunk) == crc, "a chunk whose checksum does not match")
                self.chunks[-1].append(chunk)
                self.offsets[-1].append(at)
                at += length
        require(at == len(file), "chunks whose lengths do not add up")


def max_token_bytes(tokens, has_klt):  # appendix A
    """The bound on a chunk of token strings: one of coding 3, or two and a colour KLT."""
    return (584 if has_klt else 281) + 3 * tokens + tokens // 256


def is_valid_entry(coding, count, tile, length, content):  # appendix A
    columns, rows = tile
    halves = 6 * columns * rows * count
    blocks = -(-columns // 8) * -(-rows // 8)
    low, high, max_bytes = {
        1: (1, 192 * blocks * count, max_token_bytes(content, True)),
        3: (1, halves // 2, max_token_bytes(content, False)),
    }.get(coding, (halves, halves, bound(content)))
    return low <= content <= min(high, MAX_CONTENT_BYTES) and length <= max_bytes


def split_levels(file):  # section 12
    """The file, or its root and its shards in file order, each an index and its bytes."""
    require(len(file) >= 144, "a header that is cut short")
    root_bytes = unpack_from("<Q", file, 88)[0]
    root = FileIndex(file[:root_bytes])
    require(root.place is None, "a shard without its file")
    if root.table is None:
        require(root_bytes == len(file), "bytes after the end of the file")
        return [(root, file)]
    require(len(root.table) >= 24, "a table of levels that is cut short")
    *sides, levels, shard_side = unpack_from("<6I", root.table)
    require(all(1 <= side <= MAX_SIDE for side in sides), "a side of level 0")
    require(sides[0] * sides[1] <= MAX_AREA, "the number of pixels of level 0")
    require(sides[2] * sides[3] <= MAX_AREA, "the number of light elements of level 0")
    require(2 <= levels <= MAX_LEVELS, "the number of levels")
    is_shard_side = SHARD_SIDES[0] <= shard_side <= SHARD_SIDES[1]
    require(is_shard_side and shard_side & (shard_side - 1) == 0, "the side of shards")
    extents = [[-(-side >> level) for side in sides] for level in range(levels)]
    own = [root.width, root.height, root.light_width, root.light_height]
    require(extents[-1] == own, "a root of another size")
    require(max(own[:2]) <= shard_side, "a root of more than one shard")
    places = [
        (level, x, y)
        for level in range(levels - 2, -1, -1)
        for y, x in sorted(
            ((y, x) for y in shard_starts(extents[level][1], shard_side)
             for x in shard_starts(extents[level][0], shard_side)),
            key=lambda place: morton(place[1] // shard_side, place[0] // shard_side),
        )
    ]
    require(len(root.table) == 24 + 4 * len(places), "the number of shards")
    parts, at = [(root, file[:root_bytes])], root_bytes
    for (level, x, y), length in zip(places, unpack_from(f"<{len(places)}I", root.table, 24)):
        part = file[at : at + length]
        index, at = FileIndex(part), at + length
        width, height, light_width, light_height = extents[level]
        require(index.place and index.place[:3] == (level, x, y), "a shard at another place")
        size = min(shard_side, width - x), min(shard_side, height - y)
        require((index.width, index.height) == size, "a shard of another size")
        require(index.place[5:] == (light_width, light_height), "the light plane of a level")
        parts.append((index, part))
    require(at == len(file), "shards whose lengths do not add up")
    return parts


def shard_starts(side, shard_side):
    return range(0, side, shard_side)


def morton(column, row):  # section 12
    return sum((column >> i & 1) << 2 * i | (row >> i & 1) << 2 * i + 1 for i in range(32))


def read_metadata(data):  # appendix C
    class Fields(list):
        """The fields of an object, repeated ones included."""

    def is_object(value, types):
        if not isinstance(value, Fields):
            return False
        known = [(types[name](field), name) for name, field in value if name in types]
        return len(known) == len(set(known)) and all(valid for valid, _ in known)

    def is_integer(value):
        return type(value) is int

    def is_factor(value):
        return type(value) in (int, float) and abs(value) <= MAX_COLOR_FACTOR

    def is_triple(value, is_entry):
        return type(value) is list and len(value) == 3 and all(map(is_entry, value))

    def parse_int(text):
        return int(text) if text[0] != "-" else float(text)

    def refuse_constant(name):
        raise ValueError(name)

    strings = ["title", "creator", "rights", "writer", "method", "units"]
    types = dict.fromkeys(strings, lambda value: isinstance(value, str))
    counts = {"patterns": is_integer, "photographs": is_integer}
    types["capture"] = lambda value: is_object(value, counts)
    types["shots_used"] = lambda value: type(value) is list and all(map(is_integer, value))
    types["color_matrix"] = lambda value: is_triple(value, lambda row: is_triple(row, is_factor))
    types["origin"] = lambda value: True
    try:
        decoder = json.JSONDecoder(
            object_pairs_hook=Fields, parse_int=parse_int, parse_constant=refuse_constant
        )
        value = decoder.decode(data.decode())
    except (ValueError, RecursionError) as error:
        raise Refused(error) from None
    require(is_object(value, types), "metadata of another form")


def join_bytes(data, kind):
    """Values of two bytes from all low bytes, then all high bytes."""
    return np.frombuffer(data, np.uint8).reshape(2, -1).T.copy().view(kind).reshape(-1)


def read_basis(chunk, functions, area):  # section 5
    content = decompress(chunk, functions * (1 + 2 * area))
    exponents = np.frombuffer(content[:functions], np.uint8)
    require(exponents.max() <= MAX_EXPONENT, "an exponent")
    code = join_bytes(content[functions:], "<u2").astype(int).reshape(functions, area)
    number = np.where(code % 2 == 0, code >> 1, -(code >> 1) - 1)
    return (number / 2.0 ** exponents[:, None]).astype(f32)


class TokenString:  # section 6
    def __init__(self, data, max_tokens):
        require(data[:1] in (b"\1", b"\3"), "another number of token streams")
        at = 1 + 8 * data[0]
        require(at <= len(data), "a token string that is cut short")
        self.lengths = [unpack_from("<II", data, 1 + 8 * i) for i in range(data[0])]
        self.count = sum(tokens for tokens, _ in self.lengths)
        require(self.count <= max_tokens, "too many tokens")
        self.contents = []
        for tokens, length in self.lengths:
            require(at + length <= len(data), "a token string that is cut short")
            frame = data[at : at + length]
            self.contents.append(decompress(frame, tokens) if tokens or frame else b"")
            at += length
        self.streams = [iter(content) for content in self.contents]
        self.bits, self.taken = int.from_bytes(data[at:], "little"), 0
        self.bit_count = 8 * (len(data) - at)

    def take(self, count):
        bits = self.bits >> self.taken & (1 << count) - 1
        self.taken += count
        require(self.taken <= self.bit_count, "too few bits")
        return bits

    def read_run(self, length, trace=lambda *_: None):
        """The numbers of a run. `trace` gets each token with its context, bits, index and number."""
        numbers = [0] * length
        at = context = 0
        while at < length:
            token = next(self.streams[context if len(self.streams) > 1 else 0], None)
            require(token is not None, "too few tokens")
            own_context, context = context, 1 if token % 16 <= 1 else 2
            if token == 0:
                trace(own_context, token, None, at, 0)
                break
            if token == 0xF0:
                trace(own_context, token, None, at, 0)
                at += 16
                continue
            size = token % 16
            at += token >> 4
            require(size > 0 and at < length, "an invalid token")
            sign, below = self.take(1), self.take(size - 1)
            magnitude = (1 << size - 1) + below
            numbers[at] = -magnitude if sign else magnitude
            bits = [sign, *(below >> i & 1 for i in range(size - 1))]
            trace(own_context, token, bits, at, numbers[at])
            at += 1
        return numbers

    def finish(self):
        no_tokens = all(next(stream, None) is None for stream in self.streams)
        require(no_tokens, "tokens after the last run")
        no_bits = self.bit_count - self.taken < 8 and not self.bits >> self.taken
        require(no_bits, "bits after the last run")


# Section 7.1.
COSINE_BITS = "3F800000 3F7B14BE 3F6C835E 3F54DB31 3F3504F3 3F0E39DA 3EC3EF15 3E47C5C2 00000000"
COSINES = np.frombuffer(bytes.fromhex(COSINE_BITS), ">f4").astype(f32)


def dct_factor(f, x):
    i = (2 * x + 1) * f % 32
    i = 32 - i if i > 16 else i
    cosine = COSINES[i] if i <= 8 else -COSINES[16 - i]
    return f32(0.5) * (COSINES[4] if f == 0 else cosine)


G = np.array([[dct_factor(f, x) for x in range(8)] for f in range(8)], f32)
ZIGZAG = [  # frequency, 8 · row + column, of each zigzag index
    8 * row + total - row
    for total in range(15)
    for row in (range(total, -1, -1) if total % 2 == 0 else range(total + 1))
    if row < 8 and total - row < 8
]


def inverse_dct(numbers, step):
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
    """The sum of a tile's chunks of coding 1: `[component, axis, row, column]`."""

    def __init__(self, tile, rank):
        columns, rows = tile
        self.planes = np.zeros((rank, 3, rows, columns), f32)
        self.blocks = [(y, x) for y in range(0, rows, 8) for x in range(0, columns, 8)]
        self.present, self.klt = [False] * rank, None

    def split(self, chunk, content_bytes, components):
        """The token strings of a chunk, main and side."""
        if components[0] == 0 and self.klt is None:
            require(len(chunk) >= 18, "a colour KLT that is cut short")
            self.klt = np.frombuffer(chunk[:18], "<i2").reshape(3, 3)
            chunk = chunk[18:]
        require(len(chunk) >= 4, "a chunk that is cut short")
        end = 4 + unpack_from("<I", chunk)[0]
        require(end <= len(chunk), "a chunk that is cut short")
        main = TokenString(chunk[4:end], content_bytes)
        side = TokenString(chunk[end:], content_bytes - main.count)
        require(main.count + side.count == content_bytes, "too few tokens")
        return main, side

    def add(self, chunk, content_bytes, components, step):
        main, side = self.split(chunk, content_bytes, components)
        for tokens, axes in (main, [0]), (side, [1, 2]):
            for k in components:
                for y, x in self.blocks:
                    numbers = tokens.read_run(64 * len(axes))
                    self.present[k] |= any(numbers)
                    for i, axis in enumerate(axes):
                        pixels = inverse_dct(numbers[i :: len(axes)], step)
                        inside = self.planes[k, axis, y : y + 8, x : x + 8]
                        inside += pixels[: inside.shape[0], : inside.shape[1]]
            tokens.finish()

    def coefficients(self):  # section 7.2
        rank = len(self.present)
        planes = self.planes.reshape(rank, 3, -1)
        c = np.zeros_like(planes)
        if self.present[0]:
            unit = self.klt.astype(f32) / f32(16384)
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


def add_halves(values, items, chunk, step):  # sections 7.3 and 8
    halves = join_bytes(decompress(chunk, 6 * len(values) * len(items)), "<f2")
    require(np.isfinite(halves).all(), "a half float that is not finite")
    halves = halves.reshape(len(items), 3, -1).transpose(2, 0, 1)
    values[:, items] += halves.astype(f32) * step


def centre_out_order(w):  # section 8
    def distance(slot):
        return (slot % w - w // 2) ** 2 + (slot // w - w // 2) ** 2

    return sorted(range(w * w), key=lambda slot: (distance(slot), slot))


def colours_of(numbers):  # section 8: YCoCg-R to red, green and blue, on the last axis
    luma, co, cg = np.moveaxis(np.asarray(numbers), -1, 0)
    middle = luma - (cg >> 1)
    blue = middle - (co >> 1)
    return np.stack([blue + co, cg + middle, blue], axis=-1)


def add_direct(values, slots, chunk, content_bytes, step):  # section 8
    tokens = TokenString(chunk, content_bytes)
    require(tokens.count == content_bytes, "too few tokens")
    numbers = np.array([tokens.read_run(3 * len(slots)) for _ in values])
    tokens.finish()
    values[:, slots] += colours_of(numbers.reshape(-1, len(slots), 3)).astype(f32) * step


@np.errstate(all="ignore")  # reflections that are not used, and large steps, overflow
def decode(file, scans=None):  # section 4
    """c and d of each tile, and the basis; of the first `scans` scans, or all."""
    index = FileIndex(file)
    area, order = index.w**2, centre_out_order(index.w)
    scans = range(index.scan_count if scans is None else scans)
    basis = [np.zeros((0, area), f32)]
    for s in scans:
        if index.new_functions[s]:
            basis.append(read_basis(index.chunks[s][0], index.new_functions[s], area))
    tiles = []
    for t, tile in enumerate(index.tiles):
        planes, pixels = Planes(tile, index.rank), tile[0] * tile[1]
        c, d = (np.zeros((pixels, each, 3), f32) for each in (index.rank, area))
        for s in scans:
            coding, first, count, _, step, _, _ = index.scans[s]
            chunk, content_bytes = index.chunks[s][1 + t], index.content_bytes[s][t]
            items, step = range(first, first + count), f32(step)
            if not chunk:
                continue
            if coding == 1:
                planes.add(chunk, content_bytes, items, step)
            elif coding == 2:
                add_halves(c, items, chunk, step)
            elif coding == 3:
                add_direct(d, [order[i] for i in items], chunk, content_bytes, step)
            else:
                add_halves(d, [order[i] for i in items], chunk, step)
        tiles.append((planes.coefficients() if any(planes.present) else c, d))
    return tiles, np.concatenate(basis)


def window_origin(index, x, y):  # section 9
    a0, a1, a2, b0, b1, b2 = index.affine
    whole_x, whole_y = index.first_x + x, index.first_y + y
    u = a0 * (whole_x + 0.5) + a1 * (whole_y + 0.5) + a2
    v = b0 * (whole_x + 0.5) + b1 * (whole_y + 0.5) + b2
    if index.displacement:
        u += displacement_at(index, 0, x, y)
        v += displacement_at(index, 1, x, y)
    u, v = u - index.first_u, v - index.first_v

    def limited_floor(value):
        if math.isnan(value):
            return 0
        return math.floor(min(max(value, -(2.0**31)), 2.0**31 - 1))

    return limited_floor(u) - (index.w - 1) // 2, limited_floor(v) - (index.w - 1) // 2


def displacement_at(index, axis, x, y):  # sections 9 and 12
    spacing, step, codes = index.displacement
    code = codes[axis].tolist()
    gx = (index.first_x + x + 0.5) / spacing - index.first_x // spacing
    gy = (index.first_y + y + 0.5) / spacing - index.first_y // spacing
    i, j = min(math.floor(gx), len(code[0]) - 2), min(math.floor(gy), len(code) - 2)
    right, down = gx - i, gy - j
    above = code[j][i] + (code[j][i + 1] - code[j][i]) * right
    below = code[j + 1][i] + (code[j + 1][i + 1] - code[j + 1][i]) * right
    return (above + (below - above) * down) * step


def element_of_slot(index, origin, slot):  # section 9
    """The number of the slot's light element; None off the light plane."""
    u, v = origin[0] + slot % index.w, origin[1] + slot // index.w
    on_plane = 0 <= u < index.light_width and 0 <= v < index.light_height
    return v * index.light_width + u if on_plane else None


def unmasked_function(c, d, basis):  # section 9, in binary64: d + Σ c v, [slot, channel]
    tau = d.astype(float)
    for coefficients, function in zip(c.astype(float), basis.astype(float)):
        tau += function[:, None] * coefficients
    return tau


def emission_of_code(code):  # section 10
    e = code / 255
    return e / 12.92 if e <= 0.04045 else ((e + 0.055) / 1.055) ** 2.4


def code_of_light(y):  # section 10
    y = min(max(y, 0.0), 1.0)
    e = 12.92 * y if y <= 0.0031308 else 1.055 * y ** (1 / 2.4) - 0.055
    return math.floor(255 * e + 0.5)


def dump(file):  # appendix G
    return b"".join(dump_part(index, part) for index, part in split_levels(file))


def dump_part(index, file):
    tiles, basis = decode(file)
    values = [value for tile in tiles for value in tile] + [basis]
    values = b"".join(np.ascontiguousarray(value, "<f4").tobytes() for value in values)
    if index.displacement or index.place:
        pixels = [(x, y) for y in range(index.height) for x in range(index.width)]
        values += np.array([window_origin(index, x, y) for x, y in pixels], "<i4").tobytes()
    return values


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
