"""Measures the stages whose work or memory must not grow with the picture: plan, learn and assemble.

python3 gigapixel.py [--program ltm-export] [--side 16384] [--patterns 80] [--tiles 65536] [--report FILE.json]

A capture of 1,024 x 1,024 pixels and 128 x 128 light elements is simulated and repeated along both axes. Its
photographs are TIFFs as `ltm-export stage ingest` writes them, but tiles that repeat are in the file once only.

  plan, learn   of `--side` pixels a side, with the default options
  assemble      of a picture of one level in so many tiles, of the packs of 256 shards. The first shard is recovered,
                and the others have its tiles

For each stage: seconds, the largest resident memory, and the bytes of all reads, from the page cache as well.
Needs Linux, Python 3.11, numpy, OpenCV, crc32c, zstandard, and 4 GB of disk space.
"""

import argparse
import hashlib
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy
import zstandard
from crc32c import crc32c

REPO = Path(__file__).resolve().parent.parent
# Also the columns of a TIFF tile.
SMALL_SIDE = 1024
TILE_ROWS = 16
CODES = 1 << 16
TILE_SIDE = 128
SHARDS = 256
# Camera pixels along a side for each light element.
ELEMENT_SIDE = 8
# Options with which a shard of the picture to assemble is recovered within a minute, and small.
QUICK = ("--method", "nnls", "--window", "5", "--levels", "1", "--quality", "5")
QUICK_PATTERNS = 16
PACK_MAGIC = b"LTMPACK3"
KEY, COUNTS = 0xFFFFFFFF, 0xFFFFFFFE


def main():
    """Runs the measurements and prints them."""
    args = parse_arguments()
    report = {"side": args.side, "patterns": args.patterns, "tiles": args.tiles}
    with tempfile.TemporaryDirectory(prefix="gigapixel-bench-") as temporary:
        folder = Path(temporary)
        small = simulate(args, folder)
        if args.side:
            capture, stages = folder / "large", folder / "large.stages"
            repeat_capture(small, capture, args.side // SMALL_SIDE, args.patterns)
            report["photographs_bytes"] = 6 * args.side**2 * (args.patterns + 2)
            report["plan"] = measured([args.program, "stage", "plan", capture, "-o", stages])
            report["learn"] = measured([args.program, "stage", "learn", stages])
        if args.tiles:
            report["assemble"] = measure_assemble(args, small, folder)
    print_report(report)
    if args.report:
        args.report.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def parse_arguments():
    """The arguments."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    program = os.environ.get("LTM_EXPORT", REPO / "target/release/ltm-export")
    parser.add_argument("--program", default=program, type=Path)
    parser.add_argument("--side", type=int, default=16384, help="pixels, a multiple of 1,024; 0 for none")
    parser.add_argument("--patterns", type=int, default=80)
    parser.add_argument(
        "--tiles", type=int, default=65536, help="tiles to assemble, the square of a multiple of 8; 0 for none"
    )
    parser.add_argument("--report", type=Path, help="JSON file to write")
    args = parser.parse_args()
    if args.side % SMALL_SIDE or args.tiles != (math.isqrt(args.tiles) // 8 * 8) ** 2:
        parser.error("--side is no multiple of 1,024, or --tiles not the square of a multiple of 8")
    return args


def simulate(args, folder):
    """A small capture."""
    small = folder / "small"
    sides = [
        "--camera",
        f"{SMALL_SIDE}x{SMALL_SIDE}",
        "--light",
        f"{SMALL_SIDE // ELEMENT_SIDE}x{SMALL_SIDE // ELEMENT_SIDE}",
    ]
    patterns = str(max(args.patterns, QUICK_PATTERNS))
    command = [args.program, "simulate", "stained-glass", "-o", small, *sides, "--patterns", patterns]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return small


def repeat_capture(small, large, repeats, patterns):
    """Repeats the first shots of a capture."""
    manifest = json.loads((small / "capture.json").read_text(encoding="utf-8"))
    del manifest["graycode"]
    for extent in (manifest["light"], manifest["camera"]):
        extent.update({side: repeats * extent[side] for side in ("width", "height")})
    manifest["shots"] = manifest["shots"][:patterns]
    for shot in manifest["shots"]:
        picture = cv2.imread(str(small / shot["pattern"]), cv2.IMREAD_UNCHANGED)
        (large / shot["pattern"]).parent.mkdir(parents=True, exist_ok=True)
        picture = numpy.tile(picture, (repeats, repeats) + (1,) * (picture.ndim - 2))
        cv2.imwrite(str(large / shot["pattern"]), picture, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        shot["photo"] = repeat_photograph(small, large, shot["photo"], repeats)
    for name in ("dark", "flood"):
        manifest[name] = repeat_photograph(small, large, manifest[name], repeats)
    (large / "capture.json").write_text(json.dumps(manifest), encoding="utf-8")


def repeat_photograph(small, large, name, repeats):
    """Writes a repeated photograph as an ingested TIFF. Returns its name."""
    codes = cv2.imread(str(small / name), cv2.IMREAD_UNCHANGED)[:, :, ::-1]
    side = SMALL_SIDE * repeats
    tiles = [rows.astype("<u2").tobytes() for rows in numpy.split(codes, SMALL_SIDE // TILE_ROWS)]
    counts = [numpy.bincount(codes[:, :, c].ravel(), minlength=CODES) for c in range(3)]
    histogram = zstandard.compress((numpy.array(counts, dtype="<u8") * repeats**2).tobytes())
    file = (small / name).read_bytes()
    source = {"name": name, "bytes": len(file), "sha256": hashlib.sha256(file).hexdigest()}
    source = json.dumps(source, separators=(",", ":")).encode()
    checksums = [*repeat_tiles([crc32c(tile) for tile in tiles], repeats), crc32c(histogram)]
    checksums = struct.pack(f"<{len(checksums)}I", *checksums)
    name = str(Path(name).with_suffix(".tif"))
    (large / name).parent.mkdir(parents=True, exist_ok=True)
    with open(large / name, "wb") as out:
        out.write(b"II*\0\0\0\0\0")
        offsets = []
        for tile in tiles:
            offsets.append(out.tell())
            out.write(tile)
        offsets = repeat_tiles(offsets, repeats)
        lengths = struct.pack("<I", len(tiles[0])) * len(offsets)
        offsets = struct.pack(f"<{len(offsets)}I", *offsets)
        tags = [
            (256, "I", struct.pack("<I", side)),
            (257, "I", struct.pack("<I", side)),
            (258, "H", struct.pack("<3H", 16, 16, 16)),
            (259, "H", struct.pack("<H", 1)),
            (262, "H", struct.pack("<H", 2)),
            (277, "H", struct.pack("<H", 3)),
            (322, "I", struct.pack("<I", SMALL_SIDE)),
            (323, "I", struct.pack("<I", TILE_ROWS)),
            (324, "I", offsets),
            (325, "I", lengths),
            (339, "H", struct.pack("<3H", 1, 1, 1)),
            (65100, "s", source + b"\0"),
            (65101, "B", histogram),
            (65102, "I", checksums),
            (65103, "I", struct.pack("<I", crc32c(checksums, crc32c(source)))),
        ]
        write_directory(out, tags)
    return name


def repeat_tiles(column, repeats):
    """What each tile of a column has, for the tiles of the repeated picture, row by row."""
    return [figure for figure in column for _ in range(repeats)] * repeats


def write_directory(out, tags):
    """Writes the tags of a TIFF, of type BYTE, ASCII, SHORT or LONG by their letters, after the tiles."""
    types = {"B": (1, 1), "s": (2, 1), "H": (3, 2), "I": (4, 4)}
    entries = []
    for tag, letter, values in tags:
        number, size = types[letter]
        if len(values) > 4:
            out.write(b"\0" * (-out.tell() % 2))
            place = struct.pack("<I", out.tell())
            out.write(values)
        else:
            place = values.ljust(4, b"\0")
        entries.append(struct.pack("<HHI", tag, number, len(values) // size) + place)
    out.write(b"\0" * (-out.tell() % 2))
    start = out.tell()
    out.write(struct.pack("<H", len(entries)) + b"".join(entries) + bytes(4))
    out.seek(4)
    out.write(struct.pack("<I", start))


def measure_assemble(args, small, folder):
    """Recovers a shard, gives its tiles to all others, and assembles them."""
    side = math.isqrt(args.tiles) * TILE_SIDE
    capture, stages = folder / "tiled", folder / "tiled.stages"
    repeat_capture(small, capture, side // SMALL_SIDE, QUICK_PATTERNS)
    shards = min(SHARDS, side // TILE_SIDE)
    stage = [args.program, "stage"]
    measured([*stage, "plan", capture, "-o", stages, *QUICK, "--force"])
    measured([*stage, "learn", stages])
    measured([*stage, "tiles", stages, "--shard", f"1/{shards}"])
    first = stages / "shards" / f"1-of-{shards}.pack"
    for i in range(1, shards):
        copy_pack(first, stages / "shards" / f"{i + 1}-of-{shards}.pack", i)
    out = folder / "assembled.ltm"
    figures = measured([*stage, "assemble", stages, "--shards", str(shards), "-o", out])
    subprocess.run([args.program, "inspect", out], check=True, stdout=subprocess.DEVNULL)
    packs = (stages / "shards").glob("*.pack")
    assert out.stat().st_size > 0.9 * sum(pack.stat().st_size for pack in packs), "it lacks tiles"
    return figures | {"file_bytes": out.stat().st_size}


def copy_pack(first, path, shard):
    """Writes the tiles of the first shard as those of another."""
    content = first.read_bytes()
    assert content.startswith(PACK_MAGIC)
    records, at = [PACK_MAGIC], len(PACK_MAGIC)
    while at < len(content):
        number, length = struct.unpack_from("<2I", content, at)
        data = content[at + 12 : at + 12 + length]
        at += 12 + length
        if number == KEY:
            key = json.loads(data)
            tiles = key["items"]["end"]
            key["items"] = {"start": shard * tiles, "end": (shard + 1) * tiles}
            data = json.dumps(key, separators=(",", ":")).encode()
        elif number != COUNTS:
            number += shard * tiles
        head = struct.pack("<2I", number, len(data))
        records += [head, struct.pack("<I", crc32c(data, crc32c(head))), data]
    path.write_bytes(b"".join(records))


def measured(command):
    """Runs a command. Returns its seconds, the largest resident memory, and how many bytes it read."""
    errors = tempfile.TemporaryFile()
    began = time.monotonic()
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL, stderr=errors)
    # The largest memory by `wait4` would include that of this program before it starts the command.
    memory_kib, bytes_read = 0, 0
    while process.poll() is None:
        memory_kib = max(memory_kib, process_figure(process.pid, "status", "VmHWM:"))
        bytes_read = max(bytes_read, process_figure(process.pid, "io", "rchar:"))
        time.sleep(0.02)
    if process.returncode != 0:
        errors.seek(0)
        sys.exit(f"{command}: {errors.read().decode()[-2000:]}")
    return {"seconds": time.monotonic() - began, "memory_bytes": 1024 * memory_kib, "read_bytes": bytes_read}


def process_figure(pid, file, name):
    """A number that Linux keeps of a process; 0 once it has ended."""
    try:
        lines = Path(f"/proc/{pid}/{file}").read_text(encoding="utf-8").splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) for line in lines if line.startswith(name)), 0)


def print_report(report):
    """Prints the figures as a table."""
    print("| stage | seconds | memory, MB | read, MB |\n|---|---|---|---|")
    for stage in ("plan", "learn", "assemble"):
        if stage in report:
            figures = report[stage]
            sizes = [figures[key] / 1e6 for key in ("memory_bytes", "read_bytes")]
            print(f"| {stage} | {figures['seconds']:.1f} | {sizes[0]:,.0f} | {sizes[1]:,.0f} |")
    if "learn" in report:
        share = report["learn"]["read_bytes"] / report["photographs_bytes"]
        print(f"\nAll photographs are {report['photographs_bytes'] / 1e9:.0f} GB; learn reads {share:.1%} as much.")
    if "assemble" in report:
        print(f"The file of {report['tiles']} tiles has {report['assemble']['file_bytes'] / 1e6:,.0f} MB.")


if __name__ == "__main__":
    main()
