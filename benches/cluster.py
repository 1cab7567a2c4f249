"""Measures how much faster two cores recover a large capture in shards than one core, and what a cluster would take.

python3 cluster.py [CAPTURE] [--program ltm-export] [--side 1024] [--repeat 2] [--patterns 80] [--shards 16]
                   [--slurm] [--report FILE.json]

CAPTURE is a capture folder; without it, one of `--side` pixels is simulated and repeated so often along each axis, with
its light. It is recovered on one core:

  recover      the peer: one process
  one core     pkg-scripts/cluster --cores 1

and then by pkg-scripts/cluster --cores 2; with --slurm also on one node and on two nodes of one core each of a Slurm
that the benchmark sets up on this machine, as root, from Debian's packages: in one allocation, and with a job of Slurm
for each job of the workflow. All files must have the same bytes. The times of the workflow's jobs on one core are the
input of a discrete-event simulation of a queue, which starts the jobs of each stage on free cores in order. Its
prediction for two cores is to be compared with the measurement. For 100 and 1,000 cores, and a capture of
16,384 x 16,384 pixels, there is none. Needs Python 3.11, numpy and OpenCV, and a machine that does nothing else.
"""

import argparse
import contextlib
import hashlib
import heapq
import json
import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import cv2
import numpy

REPO = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(REPO / "tests/cluster"))
from two_node_slurm import SNAKEMAKE_OPTIONS, TwoNodeSlurm, run_in_allocation  # noqa: E402

# Its nodes have 4 GB, and a job requests a quarter more than this.
SLURM_CONFIG = ["--config", "memory_mb=3000"]
# For a command that hangs.
MAX_SECONDS = 4 * 3600
# Stages in the order in which they run; the jobs of one run side by side.
STAGES = ("ingest", "plan", "learn", "tiles", "levels", "assemble")
# Those that are divided into as many jobs as there are shards.
DIVIDED = ("ingest", "tiles", "levels")
# Those whose work does not grow with the picture: learning is from a sample of fixed size.
FIXED = ("learn",)
# A shard has whole rows of tiles.
TILE_SIDE = 128
MAX_SHARDS = 256
SIMULATED_CORES = (100, 1000)
SIMULATED_SIDE = 16384
# Writes when a job of the workflow began and ended. "$2" of `stage STAGE` is the stage.
RECORDER = """#!/bin/sh
began=$(date +%s.%N)
'{program}' "$@"
status=$?
echo "$2 $began $(date +%s.%N)" >>'{times}'
exit $status
"""


def main():
    """Runs the measurements and prints them."""
    args = parse_arguments()
    with tempfile.TemporaryDirectory(prefix="cluster-bench-") as temporary:
        folder = Path(temporary)
        capture = args.capture or repeated_capture(args, folder)
        extent = json.loads((capture / "capture.json").read_text(encoding="utf-8"))["camera"]
        report, on_slurm = {"shards": args.shards}, {}
        install_engine(args, capture, folder)
        if args.slurm:
            # First, as it may be unavailable.
            with contextlib.closing(TwoNodeSlurm(folder / "slurm")) as slurm:
                slurm.start()
                for nodes in (2, 1):
                    for name, start, options in (
                        ("allocation", partial(timed_on_nodes, nodes), SLURM_CONFIG),
                        ("jobs", timed, [*SNAKEMAKE_OPTIONS, "--jobs", str(nodes), *SLURM_CONFIG]),
                    ):
                        run = run_workflow(args, capture, folder / f"{nodes}-{name}", options, start)
                        report[f"workflow_{name}_{nodes}_s"], on_slurm[name, nodes], _ = run
        report["recover_s"], expected = recover(args.program, capture, folder)
        for (name, nodes), file in on_slurm.items():
            if file != expected:
                sys.exit(f"the file of Slurm ({name}) with nodes: {nodes} is another than that of recover")
        for cores in (1, 2):
            start = partial(timed, pin=["taskset", "-c", "0"] if cores == 1 else [])
            options = ["--cores", str(cores)]
            seconds, file, times = run_workflow(args, capture, folder / f"{cores}-cores", options, start)
            if file != expected:
                sys.exit(f"the file of {cores} cores is another than that of recover")
            report[f"workflow_{cores}_s"] = seconds
            if cores == 1:
                durations = times
    report["durations_s"] = durations
    # What Snakemake takes between two jobs.
    jobs = sum(len(times) for times in durations.values())
    overhead = (report["workflow_1_s"] - sum(map(sum, durations.values()))) / jobs
    report["overhead_s"] = overhead
    report["simulated_s"] = {cores: makespan(durations, cores, overhead) for cores in (1, 2)}
    large = enlarged(durations, SIMULATED_SIDE**2 / (extent["width"] * extent["height"]))
    report["simulated_large_s"] = {cores: makespan(large, cores, overhead) for cores in (1, *SIMULATED_CORES)}
    print_report(report)
    if args.report:
        args.report.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def parse_arguments():
    """The arguments."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path, nargs="?", help="capture folder")
    parser.add_argument("--program", default=REPO / "target/release/ltm-export", type=Path)
    parser.add_argument("--side", type=int, default=1024, help="sides of the simulated capture in pixels")
    parser.add_argument("--repeat", type=int, default=2, help="how often it is repeated along each axis")
    parser.add_argument("--patterns", type=int, default=80)
    parser.add_argument("--shards", type=int, default=16)
    parser.add_argument("--slurm", action="store_true", help="measure on a Slurm of two nodes, too")
    parser.add_argument("--report", type=Path, help="JSON file to write")
    return parser.parse_args()


def repeated_capture(args, folder):
    """Simulates a capture, and repeats its photographs and patterns: light and windows repeat alike."""
    small, large = folder / "small", folder / "large"
    sides = ["--camera", f"{args.side}x{args.side}", "--light", f"{args.side // 2}x{args.side // 2}"]
    simulate = [args.program, "simulate", "stained-glass", "-o", small, *sides, "--patterns", str(args.patterns)]
    subprocess.run(simulate, check=True, stdout=subprocess.DEVNULL)
    manifest = json.loads((small / "capture.json").read_text(encoding="utf-8"))
    del manifest["graycode"]
    for extent in (manifest["light"], manifest["camera"]):
        extent.update({side: args.repeat * extent[side] for side in ("width", "height")})
    names = {name for shot in manifest["shots"] for name in shot.values()} | {manifest["dark"], manifest["flood"]}
    for name in names:
        picture = cv2.imread(str(small / name), cv2.IMREAD_UNCHANGED)
        repeats = (args.repeat, args.repeat) + (1,) * (picture.ndim - 2)
        (large / name).parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(large / name), numpy.tile(picture, repeats), [cv2.IMWRITE_PNG_COMPRESSION, 1])
    (large / "capture.json").write_text(json.dumps(manifest), encoding="utf-8")
    return large


def recover(program, capture, folder):
    """The seconds of a recovery on one core, and the hash of the file."""
    file = folder / "recovered.ltm"
    one_core = {"RAYON_NUM_THREADS": "1"}
    command = [program, "recover", capture, "-o", file]
    seconds = timed(command, os.environ | one_core, ["taskset", "-c", "0"])
    return seconds, hash_of(file)


def install_engine(args, capture, folder):
    """A dry run, which installs Snakemake if it is missing: no measurement is to have this."""
    command = [REPO / "pkg-scripts/cluster", capture, "-o", folder / "dry-run", "--cores", "1", "--dry-run"]
    timed(command, os.environ | {"LTM_EXPORT": str(args.program)})


def run_workflow(args, capture, folder, options, start):
    """The seconds of the workflow, the hash of the file, and the seconds of its jobs by stage.

    `start` runs a command with an environment, and returns the seconds.
    """
    captures, results = folder / "captures", folder / "results"
    captures.mkdir(parents=True)
    (captures / "large").symlink_to(capture.resolve())
    recorder, times = folder / "ltm-export", folder / "times"
    recorder.write_text(RECORDER.format(program=args.program.resolve(), times=times), encoding="utf-8")
    recorder.chmod(0o755)
    command = [REPO / "pkg-scripts/cluster", captures, "-o", results, *options]
    command += ["--config", "shard_pixels=1", f"shards={args.shards}"]
    seconds = start(command, os.environ | {"LTM_EXPORT": str(recorder)})
    durations = {stage: [] for stage in STAGES}
    for line in times.read_text(encoding="utf-8").splitlines():
        stage, began, ended = line.split()
        if stage in durations:
            durations[stage].append(float(ended) - float(began))
    return seconds, hash_of(results / "large.ltm"), durations


def timed(command, environment, pin=()):
    """Runs a command, with one in front that chooses the core. Returns the seconds that it took."""
    began = time.monotonic()
    ended = subprocess.run(list(map(str, [*pin, *command])), env=environment, capture_output=True, text=True)
    if ended.returncode != 0:
        sys.exit(f"{command}: {ended.stderr[-2000:]}")
    return time.monotonic() - began


def timed_on_nodes(nodes, command, environment):
    """Runs a command in an allocation of so many nodes. Returns the seconds until its end."""
    with tempfile.TemporaryDirectory(prefix="cluster-bench-job-") as folder:
        log = Path(folder) / "log"
        began = time.monotonic()
        status = run_in_allocation(command, nodes, log, MAX_SECONDS, environment)
        seconds = time.monotonic() - began
        if status != 0:
            sys.exit(f"{command}: {log.read_text(encoding='utf-8')[-2000:]}")
    return seconds


def hash_of(path):
    """SHA-256 of a file."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def makespan(durations, cores, overhead):
    """The seconds of the stages on so many cores: a queue that starts the next job on the core that is free first."""
    now = 0.0
    for stage in STAGES:
        free = [now] * cores
        for job in durations[stage]:
            heapq.heapreplace(free, free[0] + job + overhead)
        now = max(free)
    return now


def enlarged(durations, factor):
    """The durations for a capture of SIMULATED_SIDE with so many times the pixels, in as many shards as it can have."""
    shards = min(MAX_SHARDS, SIMULATED_SIDE // TILE_SIDE)
    large = {}
    for stage, jobs in durations.items():
        work = sum(jobs) * (1 if stage in FIXED else factor)
        count = shards if stage in DIVIDED else 1
        large[stage] = [work / count] * count
    return large


def print_report(report):
    """Prints the figures as tables."""
    durations = report["durations_s"]
    print("| stage | jobs | seconds, all | longest |\n|---|---|---|---|")
    for stage in STAGES:
        print(f"| {stage} | {len(durations[stage])} | {sum(durations[stage]):.1f} | {max(durations[stage]):.1f} |")
    peer = report["recover_s"]
    print(f"\nSnakemake takes {report['overhead_s']:.2f} s for each job.")
    print("\n| | seconds | times as fast as recover |\n|---|---|---|")
    print(f"| recover, one core | {peer:.1f} | 1.00 |")
    for cores in (1, 2):
        seconds = report[f"workflow_{cores}_s"]
        print(f"| workflow, cores: {cores} | {seconds:.1f} | {peer / seconds:.2f} |")
    for name in ("allocation", "jobs"):
        for nodes in (1, 2):
            seconds = report.get(f"workflow_{name}_{nodes}_s")
            if seconds:
                print(f"| workflow on Slurm ({name}), nodes: {nodes} | {seconds:.1f} | {peer / seconds:.2f} |")
    for cores, seconds in report["simulated_s"].items():
        print(f"| simulated, cores: {cores} | {seconds:.1f} | {peer / seconds:.2f} |")
    print(f"\n| {SIMULATED_SIDE} pixels a side, simulated | hours | times as fast as one core |\n|---|---|---|")
    alone = report["simulated_large_s"][1]
    for cores, seconds in report["simulated_large_s"].items():
        print(f"| cores: {cores} | {seconds / 3600:.2f} | {alone / seconds:.1f} |")


if __name__ == "__main__":
    main()
