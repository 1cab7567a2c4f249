"""Bytes of other codecs for a band of light transport, at the SNR of our file.

python format_peers.py PROBLEM_DIR

benches/format.rs writes PROBLEM_DIR: problem.json {"camera": [W, H], "light": [LW, LH], "window": w,
"snr_db", "ours_bytes"}; origins.npy, int32 [N, 2], the window origin (u, v) of each camera pixel;
band.npy, float32 [N, w·w, 3], 0 off the light plane; and the same transport as coefficients.npy,
float32 [r, 3, H, W], over basis.npy, float32 [r, w·w], with orthonormal rows.

Prints {peer: {"bytes", "snr_db", "parameter", "encode_seconds", "decode_seconds"}}, null if a peer
does not support the problem, and "raw_f16_band_bytes". Each peer codes as coarsely as the SNR allows,
in the best of several layouts; a peer that cannot reach the SNR has "reached": false.

SNR is 20 log10(‖T‖/‖T − T̂‖), with T̂ decoded from the counted bytes. Window origins are not counted.
Encoding is timed from the band (or the coefficients) to bytes, with known parameters; decoding from
bytes to float32 in the peer's own layout.

Lossless peers get codes: the band divided by a step and rounded, and 0 below a threshold, as entropy
coders do best with a threshold slightly above half a step.
"""

import io
import itertools
import json
import math
import sys
import time
from pathlib import Path

import numpy as np

SNR_TOLERANCE_DB = 0.02  # above the target
THRESHOLDS = [0.5, 0.55, 0.6, 0.65, 0.7, 0.8, 1.0]  # in steps
LAYOUTS = {
    "slot, channel, pixel": (1, 2, 0),
    "channel, slot, pixel": (2, 1, 0),
    "channel, pixel, slot": (2, 0, 1),
    "pixel, slot, channel": (0, 1, 2),
}
MAX_DENSE_BYTES = 10**9
DENSE_BLOCK_VALUES = 1 << 22
STEP_BYTES = 4  # a float32


class Problem:
    def __init__(self, folder):
        description = json.loads((folder / "problem.json").read_text())
        self.width, self.height = description["camera"]
        self.light_width, self.light_height = description["light"]
        self.window, self.target = description["window"], description["snr_db"]
        self.band = np.load(folder / "band.npy")
        self.coefficients = np.load(folder / "coefficients.npy")
        self.basis = np.load(folder / "basis.npy")
        self.origins = np.load(folder / "origins.npy")
        slots = np.arange(self.window**2)
        u = self.origins[:, :1] + slots % self.window
        v = self.origins[:, 1:] + slots // self.window
        self.on_plane = (u >= 0) & (u < self.light_width) & (v >= 0) & (v < self.light_height)
        self.elements = v * self.light_width + u
        self.steps = {}

    def codes(self, threshold):
        """The coarsest step that reaches the target with this threshold, and its codes."""
        if threshold not in self.steps:
            # First step: for uniform rounding noise.
            noise = energy(self.band) / self.band.size / 10 ** (self.target / 10)
            self.steps[threshold] = coarsest(
                lambda step: snr(self.band, quantise(self.band, step, threshold) * step),
                self.target,
                np.sqrt(12 * noise),
            )
        step = self.steps[threshold]
        codes = quantise(self.band, step, threshold)
        if codes.max() > 65535:
            sys.exit(f"problem.json: 16-bit codes cannot reach {self.target} dB; lower snr_db")
        return step, codes.astype(np.uint16)


def quantise(values, step, threshold):
    codes = values / step
    dark = codes < threshold
    np.rint(codes, out=codes)
    codes[dark] = 0
    return codes


def energy(values):
    return np.sum(np.square(values, dtype=np.float32), dtype=float)


def decibels(signal, error):
    return 10 * np.log10(signal / max(error, 1e-30 * signal))


def snr(truth, values):
    return decibels(energy(truth), energy(truth - values))


def coarsest(snr_at, target, step):
    """The largest step whose SNR is at least the target, by a search from `step`."""
    at, fine, coarse = np.log2(step), None, None
    for _ in range(30):
        found = snr_at(np.float32(2.0**at))
        if found >= target:
            fine = at, found
        else:
            coarse = at, found
        if fine and (fine[1] - target <= SNR_TOLERANCE_DB or coarse and abs(coarse[0] - fine[0]) < 1e-4):
            break
        if fine and coarse:
            share = (fine[1] - target - SNR_TOLERANCE_DB / 2) / (fine[1] - coarse[1])
            at = fine[0] + (coarse[0] - fine[0]) * np.clip(share, 0.1, 0.9)
        else:
            at += (found - target - SNR_TOLERANCE_DB / 2) / 6
    return np.float32(2.0 ** fine[0])


def report(problem, size, reached, parameter, encode, decode):
    result = {
        "bytes": size,
        "snr_db": round(float(reached), 3),
        "parameter": parameter,
        "encode_seconds": round(encode, 3),
        "decode_seconds": round(decode, 3),
    }
    if reached < problem.target:
        result["reached"] = False
    return result


def number(codes, kind):
    """A numeric type that represents these codes exactly."""
    if kind == "float16" and codes.max() <= 2048:
        return np.float16
    return np.uint8 if codes.max() < 256 else np.uint16


def lossless(problem, options, encode, decode):
    """The smallest result of a lossless coder, and its threshold.

    encode(array, option, quick) returns bytes, decode(bytes, option, array) fills the array; with `quick`
    the encoder may be fast, as sizes only serve to compare layouts.
    """

    def arranged(codes, layout, kind):
        return np.ascontiguousarray(codes.transpose(LAYOUTS[layout]).astype(number(codes, kind)))

    _, codes = problem.codes(0.6)
    tries = {}  # by size: equal sizes mean equal layouts
    for layout, kind in itertools.product(LAYOUTS, ["integer", "float16"]):
        array = arranged(codes, layout, kind)
        for option in options:
            tries.setdefault(len(encode(array, options[option], True)), (layout, kind, option))
    leading = [tries[size] for size in sorted(tries)[:2]]

    layout, kind, option = leading[0]
    sizes = {}
    for threshold in THRESHOLDS:
        _, codes = problem.codes(threshold)
        sizes[threshold] = len(encode(arranged(codes, layout, kind), options[option], True))
    threshold = min(sizes, key=sizes.get)
    step, _ = problem.codes(threshold)

    results = []
    for layout, kind, option in leading:
        start = time.perf_counter()
        array = arranged(quantise(problem.band, step, threshold), layout, kind)
        data = encode(array, options[option], False)
        encoded = time.perf_counter() - start
        start = time.perf_counter()
        decoded = decode(data, options[option], np.empty_like(array)).astype(np.float32) * step
        took = time.perf_counter() - start
        reached = snr(problem.band, decoded.transpose(np.argsort(LAYOUTS[layout])))
        name = f"[{layout}] {array.dtype}, {option}, step {step:.4g}, threshold {threshold}"
        size = len(data) + STEP_BYTES
        results.append(report(problem, size, reached, name, encoded, took))
    return min(results, key=lambda result: result["bytes"]), threshold


def zstd(level, size):
    """zstd with a window as long as the data, up to the limit of default decoders."""
    import zstandard

    window = int(np.clip(np.ceil(np.log2(size)), 20, 27))
    parameters = zstandard.ZstdCompressionParameters.from_level(
        level, source_size=size, window_log=window, enable_ldm=size > 1 << 27
    )
    return zstandard.ZstdCompressor(compression_params=parameters)


def band_zstd(problem):
    import zstandard

    def encode(array, split, quick):
        if split:
            array = array.view(np.uint8).reshape(-1, array.itemsize).T
        data = array.tobytes()
        return zstd(5 if quick else 19, len(data)).compress(data)

    def decode(data, split, array):
        plain = np.frombuffer(zstandard.decompress(data), np.uint8)
        if split:
            plain = np.ascontiguousarray(plain.reshape(array.itemsize, -1).T)
        return plain.view(array.dtype).reshape(array.shape)

    options = {"bytes together": False, "bytes split": True}
    return lossless(problem, options, encode, decode)


def blosc(problem):
    import blosc2

    def encode(array, block, quick):
        return blosc2.compress2(
            array,
            codec=blosc2.Codec.ZSTD,
            clevel=5 if quick else 9,
            filters=[blosc2.Filter.BITSHUFFLE],
            filters_meta=[0],
            typesize=array.itemsize,
            blocksize=block,
            nthreads=1,
        )

    def decode(data, block, array):
        blosc2.decompress2(data, dst=array, nthreads=1)
        return array

    options = {"its own blocks": 0, "blocks of 1 MiB": 1 << 20, "blocks of 8 MiB": 1 << 23}
    return lossless(problem, options, encode, decode)[0]


def dense_blocks(problem, values, layout):
    """The dense matrix of a band, in blocks of its rows or columns."""
    light = problem.light_width * problem.light_height
    pixels = len(values)
    if layout == "pixel, channel, element":
        many = max(1, DENSE_BLOCK_VALUES // (3 * light))
        for first in range(0, pixels, many):
            here = slice(first, min(first + many, pixels))
            block = np.zeros((here.stop - first, 3, light), values.dtype)
            n, s = np.nonzero(problem.on_plane[here])
            block[n, :, problem.elements[here][n, s]] = values[here][n, s]
            yield block
        return
    u, v = problem.origins.T
    for row in range(problem.light_height):
        block = np.zeros((problem.light_width, 3, pixels), values.dtype)
        near = np.flatnonzero((v <= row) & (row < v + problem.window))
        for i in range(problem.window):
            n = near[(u[near] + i >= 0) & (u[near] + i < problem.light_width)]
            block[u[n] + i, :, n] = values[n, (row - v[n]) * problem.window + i]
        yield block


def dense_zstd(problem, threshold):
    import zstandard

    size = 2 * 3 * len(problem.band) * problem.light_width * problem.light_height
    if size > MAX_DENSE_BYTES:
        return None
    step, codes = problem.codes(threshold)
    codes = codes.astype(np.float16)

    def encode(layout, level):
        stream = zstd(level, size).compressobj()
        parts = [stream.compress(block) for block in dense_blocks(problem, codes, layout)]
        return b"".join([*parts, stream.flush()])

    layouts = ["element, channel, pixel", "pixel, channel, element"]
    layout = min(layouts, key=lambda layout: len(encode(layout, 3)))
    start = time.perf_counter()
    codes = quantise(problem.band, step, threshold).astype(np.float16)
    data = encode(layout, 19)
    encoded = time.perf_counter() - start

    signal = error = took = 0.0
    reader = zstandard.ZstdDecompressor().stream_reader(data)
    for block in dense_blocks(problem, problem.band, layout):
        start = time.perf_counter()
        codes = np.frombuffer(reader.read(2 * block.size), np.float16)
        decoded = codes.astype(np.float32).reshape(block.shape) * step
        took += time.perf_counter() - start
        signal += energy(block)
        error += energy(block - decoded)
    name = f"[{layout}] float16, step {step:.4g}, threshold {threshold}"
    return report(problem, len(data) + STEP_BYTES, decibels(signal, error), name, encoded, took)


def csr(problem):
    from scipy import sparse

    light = problem.light_width * problem.light_height

    def encode(codes, elements, by_pixel):
        files = []
        for c in range(3):
            n, s = np.nonzero(codes[:, :, c])
            lines = np.searchsorted(n, np.arange(len(codes) + 1))
            data = codes[n, s, c].astype(np.uint8 if codes.max() < 256 else np.uint16)
            matrix = sparse.csr_matrix((data, elements[n, s], lines), shape=(len(codes), light))
            file = io.BytesIO()
            sparse.save_npz(file, matrix if by_pixel else matrix.T.tocsr(), compressed=True)
            files.append(file.getvalue())
        return files

    # A zero saves its index too, so larger thresholds than for the other coders may be best.
    middle = problem.height // 2
    strip = slice(middle * problem.width, (middle + problem.height // 8 + 1) * problem.width)
    sizes = {}
    for threshold in [*THRESHOLDS, 1.5, 2.0, 3.0]:
        codes = problem.codes(threshold)[1][strip]
        for by_pixel in [True, False]:
            files = encode(codes, problem.elements[strip], by_pixel)
            sizes[threshold, by_pixel] = sum(map(len, files))
    threshold, by_pixel = min(sizes, key=sizes.get)

    step, _ = problem.codes(threshold)
    start = time.perf_counter()
    files = encode(quantise(problem.band, step, threshold), problem.elements, by_pixel)
    encoded = time.perf_counter() - start
    start = time.perf_counter()
    matrices = [sparse.load_npz(io.BytesIO(file)).astype(np.float32) * step for file in files]
    took = time.perf_counter() - start

    back = np.zeros_like(problem.band)
    for c, matrix in enumerate(matrices):
        entries = (matrix if by_pixel else matrix.T).tocoo()
        n, u, v = entries.row, entries.col % problem.light_width, entries.col // problem.light_width
        slots = (v - problem.origins[n, 1]) * problem.window + u - problem.origins[n, 0]
        back[n, slots, c] = entries.data
    name = f"rows of {'camera pixels' if by_pixel else 'light elements'}, "
    name += f"step {step:.4g}, threshold {threshold}"
    size = sum(map(len, files)) + STEP_BYTES
    return report(problem, size, snr(problem.band, back), name, encoded, took)


def zfp(problem):
    import zfpy

    # Axes: camera y, x; window v, u; channel c. If c comes first, each channel has an array of its own.
    def axes(layout):
        return ["yxvuc".index(axis) for axis in layout.replace(" ", "")]

    def sides(pixels):
        rows = pixels // problem.width
        return [rows, problem.width, problem.window, problem.window, 3]

    def shape(pixels, layout):
        lengths = dict(zip("yxvuc", sides(pixels)))
        return [math.prod(lengths[axis] for axis in group) for group in layout.split()]

    def fits(layout):
        """Whether the header can hold the shape: 48 bits for all sides, the same number for each."""
        lengths = shape(len(problem.band), layout)[layout[0] == "c" :]
        return max(lengths) <= 1 << 48 // len(lengths)

    def arrays(band, layout):
        array = np.ascontiguousarray(band.reshape(sides(len(band))).transpose(axes(layout)))
        array = array.reshape(shape(len(band), layout))
        return list(array) if layout[0] == "c" else [array]

    def band_of(parts, layout):
        array = np.stack(parts) if layout[0] == "c" else parts[0]
        lengths = sides(array.size // (3 * problem.window**2))
        array = array.reshape([lengths[axis] for axis in axes(layout)])
        return array.transpose(np.argsort(axes(layout))).reshape(-1, problem.window**2, 3)

    # zfp rounds its tolerance down to a power of two; scaled values have the effect of any tolerance.
    def encode(parts, step):
        return [zfpy.compress_numpy(part / step, tolerance=1.0) for part in parts]

    def decode(files, step):
        return [np.maximum(zfpy.decompress_numpy(file), 0) * step for file in files]

    def tuned(band, on_plane, layout, step):
        parts = arrays(band, layout)
        mask = on_plane[:, :, None]

        def snr_at(step):
            return snr(band, band_of(decode(encode(parts, step), step), layout) * mask)

        return coarsest(snr_at, problem.target, step)

    rows = min(problem.height, max(4, problem.height // 16 * 4))
    first = (problem.height - rows) // 2 // 4 * 4
    strip = slice(first * problem.width, (first + rows) * problem.width)
    step, tries = problem.codes(0.5)[0], []
    layouts = ["c y x v u", "c vu y x", "c yx v u", "c y x vu", "y x vu c", "yx v u c"]
    for layout in filter(fits, layouts):
        step = tuned(problem.band[strip], problem.on_plane[strip], layout, step)
        size = sum(map(len, encode(arrays(problem.band[strip], layout), step)))
        tries.append((size, layout, step))
    _, layout, step = min(tries)
    step = tuned(problem.band, problem.on_plane, layout, step)

    start = time.perf_counter()
    files = encode(arrays(problem.band, layout), step)
    encoded = time.perf_counter() - start
    start = time.perf_counter()
    parts = decode(files, step)
    took = time.perf_counter() - start
    back = band_of(parts, layout) * problem.on_plane[:, :, None]
    size = sum(map(len, files)) + STEP_BYTES
    name = f"[{layout}], tolerance 1 of numbers over {step:.4g}"
    return report(problem, size, snr(problem.band, back), name, encoded, took)


def save_jpeg(picture, quality):
    from PIL import ImageFile

    # The whole file must fit into one block; Pillow's default may be too small.
    ImageFile.MAXBLOCK = 8 * picture.width * picture.height + 65536
    files = []
    for progressive in [False, True]:
        file = io.BytesIO()
        picture.save(
            file, "JPEG", quality=quality, subsampling=0, optimize=True, progressive=progressive
        )
        files.append(file.getvalue())
    return min(files, key=len)


def save_webp(picture, quality):
    file = io.BytesIO()
    picture.save(file, "WEBP", quality=quality, method=6)
    return file.getvalue()


class Plane:
    """The coefficients of one component as an 8-bit picture."""

    def __init__(self, values, layout, save, quality):
        from PIL import Image

        colour, self.clip = layout
        self.shape, self.colour, self.quality = values.shape, colour, quality
        low, high = np.quantile(values, [self.clip, 1 - self.clip])
        self.scale, self.bias = np.float32(max(high - low, 1e-30) / 255), np.float32(low)
        codes = np.clip(np.rint((values - self.bias) / self.scale), 0, 255).astype(np.uint8)
        stacked = np.moveaxis(codes, 0, -1) if colour else codes.reshape(-1, values.shape[-1])
        self.file = save(Image.fromarray(np.ascontiguousarray(stacked)), quality)
        self.size = len(self.file) + 8

    def decode(self):
        from PIL import Image

        codes = np.asarray(Image.open(io.BytesIO(self.file)).convert("RGB" if self.colour else "L"))
        codes = np.moveaxis(codes, -1, 0) if self.colour else codes.reshape(self.shape)
        return codes * self.scale + self.bias


def planes(problem, save, qualities):
    """A picture of each component, as in viewers of reflectance transformation images.

    The three channels of a component are one colour picture, or three grey pictures in one file. Codes
    cover all values, or all but 0.1 % at either end. Each component has the option of least
    bytes + price · error, over all layouts and qualities and no picture at all; the price is the same for
    all components. SNR is measured against the band of the given coefficients.
    """
    import zstandard

    basis = zstd(19, problem.basis.nbytes).compress(problem.basis.astype(np.float16).tobytes())
    rank = len(problem.basis)
    layouts = list(itertools.product([True, False], [0.0, 0.001]))  # in colour, clipped share
    options = []
    for values in problem.coefficients:
        mine = [(0, energy(values), None)]
        for layout, quality in itertools.product(layouts, qualities):
            plane = Plane(values, layout, save, quality)
            mine.append((plane.size, energy(values - plane.decode()), (layout, quality)))
        options.append(mine)

    def chosen(price):
        return [min(mine, key=lambda option: option[0] + price * option[1])[2] for mine in options]

    def encode(choice):
        pairs = zip(problem.coefficients, choice)
        return [Plane(values, c[0], save, c[1]) if c else None for values, c in pairs]

    def decode(pictures):
        plain = zstandard.decompress(basis)
        kernels = np.frombuffer(plain, np.float16).astype(np.float32).reshape(problem.basis.shape)
        decoded = np.zeros_like(problem.coefficients)
        for k, picture in enumerate(pictures):
            if picture:
                decoded[k] = picture.decode()
        return decoded, kernels

    def snr_of(decoded, kernels):
        signal = error = 0.0
        sides = [(problem.coefficients, problem.basis), (decoded, kernels)]
        flat = [(c.reshape(rank, 3, -1), b) for c, b in sides]
        for first in range(0, len(problem.band), 4096):
            here = slice(first, first + 4096)
            truth, got = (
                np.maximum(np.tensordot(c[:, :, here], b, (0, 0)), 0) * problem.on_plane[here]
                for c, b in flat
            )
            signal += energy(truth)
            error += energy(truth - got)
        return decibels(signal, error)

    def snr_at(price):
        return snr_of(*decode(encode(chosen(price))))

    total = energy(problem.coefficients)
    low, high = np.log(1e-2 / total), np.log(1e12 / total)
    reached = snr_at(np.exp(high))
    if reached >= problem.target:
        while high - low > 1e-3 and reached - problem.target > SNR_TOLERANCE_DB:
            middle = (low + high) / 2
            found = snr_at(np.exp(middle))
            if found >= problem.target:
                high, reached = middle, found
            else:
                low = middle
    choice = chosen(np.exp(high))

    start = time.perf_counter()
    pictures = encode(choice)
    encoded = time.perf_counter() - start
    start = time.perf_counter()
    decoded = decode(pictures)
    took = time.perf_counter() - start
    kept = [picture for picture in pictures if picture]
    used = [picture.quality for picture in kept]
    name = f"{len(kept)} components of {rank}, quality {min(used)} to {max(used)}, "
    name += f"{sum(p.colour for p in kept)} in colour, {sum(p.clip > 0 for p in kept)} clamped"
    size = sum(picture.size for picture in kept) + len(basis)
    return report(problem, size, snr_of(*decoded), name, encoded, took)


def main():
    problem = Problem(Path(sys.argv[1]))
    results = {"raw_f16_band_bytes": problem.band.size * 2}
    results["band_f16_zstd19"], threshold = band_zstd(problem)
    results["dense_f16_zstd19"] = dense_zstd(problem, threshold)
    results["csr_npz"] = csr(problem)
    results["blosc2"] = blosc(problem)
    results["zfp"] = zfp(problem)
    results["jpeg_planes"] = planes(problem, save_jpeg, [*range(5, 90, 5), *range(90, 101)])
    results["webp_planes"] = planes(problem, save_webp, [*range(10, 90, 10), *range(90, 101, 2)])
    print(json.dumps(results))


if __name__ == "__main__":
    main()
