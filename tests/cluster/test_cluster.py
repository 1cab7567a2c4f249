"""Tests of the workflow: a collection, captures in shards, and a real Slurm of two nodes on this machine.

Run by `pkg-scripts/test --cluster`. LTM_EXPORT names the program.
"""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import two_node_slurm
from two_node_slurm import SNAKEMAKE_OPTIONS, SlurmUnavailable, TwoNodeSlurm, run_in_allocation, wait_until

REPO = Path(__file__).resolve().parents[2]
PROGRAM = os.path.abspath(os.environ.get("LTM_EXPORT", REPO / "target/release/ltm-export"))
# Fast, as the recovery itself has tests of its own.
OPTIONS = "--method nnls --window 7"
SECONDS = 300
# Camera pixels of three rows of tiles of the file, so that each of three shards has one.
THREE_ROWS = "128x384"

sys.path.insert(0, str(REPO / "workflow/scripts"))
from captures import Capture, CollectionError, folders_without_captures, read_collection  # noqa: E402
from engine_timing import bound_status_interval  # noqa: E402
from write_page import failures, page  # noqa: E402


def ltm_export(*args):
    """Runs the program."""
    subprocess.run([PROGRAM, *map(str, args)], check=True, capture_output=True, timeout=SECONDS)


def simulate(folder, seed, camera="64x64"):
    """Makes a small capture."""
    size = ["--camera", camera, "--light", "16x16", "--patterns", "40", "--seed", seed]
    ltm_export("simulate", "stained-glass", "-o", folder, *size)


def write_program(path, text):
    """Writes a script that can be run. Returns its path."""
    path.write_text(text, encoding="utf-8")
    path.chmod(0o755)
    return path


class WorkflowTest(unittest.TestCase):
    """A folder with captures, made once for each class, and one for results."""

    config = ()

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="cluster-test-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.captures = cls.folder / "captures"
        cls.captures.mkdir()
        cls.results = cls.folder / "results"

    def command(self, *options):
        """The command that recovers the captures."""
        config = ["--config", f"options={OPTIONS}", "memory_mb=1000", "shards=3", "shard_pixels=10000", *self.config]
        return [str(REPO / "pkg-scripts/cluster"), str(self.captures), "-o", str(self.results), *options, *config]

    def workflow(self, *options, status=0, program=PROGRAM):
        """Recovers the captures. Returns the jobs that ran, as their messages name them, in order."""
        command = ["timeout", "-k", "5", str(SECONDS), *self.command(*options)]
        environment = os.environ | {"LTM_EXPORT": str(program)}
        ended = subprocess.run(command, env=environment, capture_output=True, text=True)
        self.assertEqual(ended.returncode, status, ended.stdout[-3000:] + ended.stderr[-6000:])
        jobs = re.findall(r"^ *Job \d+: (.+)$", ended.stderr + ended.stdout, re.MULTILINE)
        return sorted(job for job in jobs if job != "write the page of results")

    def report(self):
        """The rows of report.csv by name."""
        with open(self.results / "report.csv", encoding="utf-8", newline="") as file:
            return {row["name"]: row for row in csv.DictReader(file)}

    def assert_recovered(self, *names):
        """Checks that files have the bytes of `ltm-export recover`."""
        for name in names:
            alone = self.folder / f"{name}-alone.ltm"
            if not alone.exists():
                ltm_export("recover", self.captures / name, "-o", alone, *OPTIONS.split())
            self.assertEqual((self.results / f"{name}.ltm").read_bytes(), alone.read_bytes(), name)


class CollectionTest(WorkflowTest):
    """A collection on this machine."""

    def test_a_broken_capture_is_reported_and_runs_alone_when_repaired(self):
        numbers = range(1, 21)
        for seed in numbers:
            simulate(self.captures / f"window {seed}", seed)
        photograph = self.captures / "window 2/photos/0005.png"
        intact = shutil.copy2(photograph, self.folder)
        photograph.write_bytes(photograph.read_bytes()[:1000])

        whole = [f"window {i}" for i in numbers if i != 2]
        self.assertEqual(self.workflow(), sorted(f"window {i}: recover" for i in numbers))
        self.assert_recovered(*whole)
        broken = self.report()["window 2"]
        self.assertEqual((broken["status"], broken["exit_status"]), ("failed", "65"))
        self.assertIn(str(photograph), broken["error"])
        self.assertIn("photos/0005.png", (self.results / "index.html").read_text(encoding="utf-8"))
        for name in whole:
            row = self.report()[name]
            self.assertEqual((row["status"], row["exit_status"], row["error"]), ("recovered", "0", ""))
            self.assertGreater(float(row["snr_db"]), 5)
            self.assertTrue((self.results / f"{name}.png").exists())

        self.assertEqual(self.workflow(), [], "a capture at fault is not repeated")
        # With its old date, as a copy from a camera has.
        shutil.copy2(intact, photograph)
        self.assertEqual(self.workflow(), ["window 2: recover"])
        self.assert_recovered("window 2")
        self.assertEqual(self.report()["window 2"]["status"], "recovered")

        (self.results / "window 3.ltm").unlink()
        self.assertEqual(self.workflow(), ["window 3: recover"], "a deleted file is made again")
        self.assert_recovered("window 3")


# Stands for a disk that is full: c1 fails once, and c2 until there is a file "space".
FULL_DISK = """#!/bin/sh
case "$1 $2" in
  "recover "*/c[12])
    echo "$2" >>tries
    if [ "${2##*/}" = c1 ]; then most=1; else most=99; fi
    if [ ! -e space ] && [ "$(grep -c "$2" tries)" -le $most ]; then
      echo "error: disk full" >&2
      exit 75
    fi
    ;;
esac
exec PROGRAM "$@"
"""


class TemporaryFailureTest(WorkflowTest):
    """Failures that may pass."""

    def test_exit_status_75_is_repeated_and_then_left_to_the_next_run(self):
        for seed in (1, 2, 3):
            simulate(self.captures / f"c{seed}", seed)
        program = write_program(self.folder / "ltm-export", FULL_DISK.replace("PROGRAM", PROGRAM))
        self.workflow(status=1, program=program)
        tries = (self.results / "tries").read_text(encoding="utf-8").split()
        self.assertEqual([tries.count(str(self.captures / name)) for name in ("c1", "c2")], [2, 3])
        self.assert_recovered("c1", "c3")
        row = self.report()["c2"]
        self.assertEqual((row["status"], row["exit_status"], row["error"]), ("unfinished", "75", "disk full"))

        (self.results / "space").touch()
        self.assertEqual(self.workflow(program=program), ["c2: recover"])
        self.assert_recovered("c2")
        self.assertEqual(self.report()["c2"]["status"], "recovered")


class KilledDriverTest(WorkflowTest):
    """The end of Snakemake itself."""

    # Seven rows of tiles.
    config = ("shards=7",)

    def test_after_kill_9_only_unfinished_work_runs(self):
        """A capture in shards, beside captures that are one job each."""
        simulate(self.captures / "large", 7, "64x896")
        for seed in range(1, 7):
            simulate(self.captures / f"c{seed}", seed)
        program = write_program(self.folder / "ltm-export", f"#!/bin/sh\nexec '{PROGRAM}' \"$@\"\n")
        environment = os.environ | {"LTM_EXPORT": str(program)}
        devnull = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        run = subprocess.Popen(self.command("--cores", "2"), env=environment, **devnull)
        packs = self.results / "stages/large/shards"

        def finished():
            captures = {path.name.split(".")[0] for path in self.results.glob("*.result.json")}
            return captures, {path.name.split("-")[0] for path in packs.glob("*-of-7.pack")}

        wait_until(lambda: min(map(len, finished())) >= 2, SECONDS)
        # pkg-scripts/cluster has become Snakemake.
        run.send_signal(signal.SIGKILL)
        run.wait()
        wait_until(lambda: not processes(str(self.folder)), 30)
        captures, shards = finished()
        self.assertLess(len(captures), 7)
        self.assertLess(len(shards), 7)

        write_program(program, SHARD_RECORDER.replace("PROGRAM", PROGRAM))
        jobs = self.workflow("--cores", "2", program=program)
        ran = {job.split(":")[0] for job in jobs if job.endswith(": recover")}
        # Snakemake does not know of a job that ended as it was killed, so that it runs again.
        self.assertLessEqual(len(ran & captures), 2)
        self.assertEqual(ran | captures, {f"c{seed}" for seed in range(1, 7)})
        self.assertLess(len(ran), 6)
        # Shards that it does not know of are complete, and nothing of them is recovered again.
        recovered = (self.results / "recovered-shards").read_text(encoding="utf-8").split()
        self.assertEqual(sorted(recovered), sorted({str(i) for i in range(1, 8)} - shards))
        self.assert_recovered("large", *(f"c{seed}" for seed in range(1, 7)))


# Adds the numbers of shards that are recovered to a file, but not of those that are complete.
SHARD_RECORDER = """#!/bin/sh
[ "$1 $2" = "stage tiles" ] || exec 'PROGRAM' "$@"
printed=$('PROGRAM' "$@") || exit $?
case $printed in
  *"is complete"*) ;;
  *) echo "${5%/*}" >>recovered-shards ;;
esac
"""


# The jobs of a capture in three shards, sorted.
STAGES = [
    "assemble",
    *(f"ingest {i} of 3" for i in range(1, 4)),
    "learn",
    *(f"make coarser levels {i} of 3" for i in range(1, 4)),
    "plan",
    *(f"recover tiles {i} of 3" for i in range(1, 4)),
]


class ShardsTest(WorkflowTest):
    """A capture in shards on this machine."""

    def test_shards_give_the_bytes_of_recover(self):
        simulate(self.captures / "large", 1, THREE_ROWS)
        jobs = [job for job in self.workflow() if job.startswith("large: ")]
        self.assertEqual(jobs, [f"large: {stage}" for stage in STAGES])
        self.assert_recovered("large")
        self.assertFalse((self.results / "stages/large").exists())
        self.assertEqual(self.workflow(), [])

    def test_a_fault_in_a_stage_is_the_captures(self):
        capture = self.captures / "at fault"
        simulate(capture, 2, THREE_ROWS)
        photograph = capture / "photos/0003.png"
        intact = shutil.copy2(photograph, self.folder)
        photograph.write_bytes(photograph.read_bytes()[:1000])
        self.workflow()
        row = self.report()["at fault"]
        self.assertEqual((row["status"], row["exit_status"]), ("failed", "65"))
        self.assertIn("photos/0003.png", row["error"])
        self.assertEqual(self.workflow(), [])
        shutil.copy2(intact, photograph)
        self.workflow()
        self.assert_recovered("at fault")

    def test_a_shard_that_is_killed_at_half_resumes(self):
        simulate(self.captures / "killed", 4, THREE_ROWS)
        whole = self.folder / "whole"
        ltm_export("stage", "plan", self.captures / "killed", "-o", whole, *OPTIONS.split())
        ltm_export("stage", "learn", whole)
        _, written = bytes_read_and_written([PROGRAM, "stage", "tiles", whole, "--shard", "1/3"])
        # Recovered tiles, which are larger than the coded ones of the pack.
        half = (written - (whole / "shards/1-of-3.pack").stat().st_size) // 2
        killer = KILLER.replace("PROGRAM", PROGRAM).replace("HALF", str(half))
        program = write_program(self.folder / "killer", killer)
        self.workflow("--cores", "1", program=program)
        logs = "".join(path.read_text(encoding="utf-8") for path in self.results.glob("logs/killed/*.log"))
        kept, tiles = map(int, re.search(r"resuming with (\d+) of (\d+) tiles", logs).groups())
        # More may have ended before it was killed.
        self.assertIn(kept, range(tiles // 2 - 1, tiles + 1))
        self.assert_recovered("killed")

    def test_a_shard_reads_its_rows_and_little_more(self):
        capture, copy, stages = (self.folder / name for name in ("read", "read-copy", "read-stages"))
        simulate(capture, 5, "512x512")
        ltm_export("stage", "ingest", capture, "-o", copy)
        ltm_export("stage", "plan", copy, "-o", stages, *OPTIONS.split())
        ltm_export("stage", "learn", stages)
        photographs = [path for path in (copy / "photos").iterdir() if path.name != "flood.tif"]
        pixels = 6 * 512 * 512
        rows = len(photographs) * pixels / 4
        # What was learned, once to be checked; the records of photographs and patterns are much smaller.
        others = 2 * (stages / "learned.bin").stat().st_size
        for i in range(1, 5):
            read, written = bytes_read_and_written([PROGRAM, "stage", "tiles", stages, "--shard", f"{i}/4"])
            # Recovered tiles are read again to be encoded.
            others_of_shard = others + written - (stages / f"shards/{i}-of-4.pack").stat().st_size
            self.assertLessEqual(read - others_of_shard, 1.3 * rows, i)
            self.assertGreater(read - others_of_shard, 0.8 * rows, i)


# Kills the first shard with kill -9, and itself, when it has half of its tiles.
KILLER = """#!/bin/sh
if [ "$1 $2" = "stage tiles" ] && mkdir killed 2>/dev/null; then
  'PROGRAM' "$@" &
  while [ "$(cat "$3"/shards/*.partial 2>/dev/null | wc -c)" -lt HALF ]; do
    kill -0 $! || exit 1
    sleep 0.01
  done
  kill -9 $! $$
fi
exec 'PROGRAM' "$@"
"""


def bytes_read_and_written(command):
    """Runs a command that has to succeed. Returns the bytes of all its reads, and of all its writes."""
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    # Linux keeps the counts until the process is waited for.
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    counts = Path(f"/proc/{process.pid}/io").read_text(encoding="utf-8")
    if process.wait() != 0:
        raise subprocess.CalledProcessError(process.returncode, command)
    return tuple(int(re.search(rf"^{name}: (\d+)", counts, re.MULTILINE)[1]) for name in ("rchar", "wchar"))


class ShardsOfPngsTest(WorkflowTest):
    """A capture in shards that is not ingested."""

    config = ("ingest=false",)

    def test_shards_give_the_bytes_of_recover(self):
        simulate(self.captures / "large", 3, THREE_ROWS)
        self.assertEqual(self.workflow(), [f"large: {stage}" for stage in STAGES if "ingest" not in stage])
        self.assert_recovered("large")


# Stands for ltm-export without any work. The file "fails" has lines of a stage or capture and its exit status.
PRETENDER = """#!/bin/sh
key=$1
[ "$1" = stage ] && key=$2
[ "$1" = recover ] && key=${2##*/}
status=$(sed -n "s/^$key //p" fails 2>/dev/null)
if [ -n "$status" ]; then
  echo "error: $key fails" >&2
  exit $status
fi
for argument; do
  [ "$before" = -o ] && output=$argument
  before=$argument
done
case $key in
  ingest) mkdir -p "$output" && echo "$key" >"$output/capture.json" ;;
  plan) mkdir -p "$output/shards" && echo plan >"$output/plan.json" ;;
  learn) echo learned >"$3/learned.bin" ;;
  tiles) echo tiles >"$3/shards/${5%/*}-of-${5#*/}.pack" ;;
  levels) echo levels >"$3/shards/${5%/*}-of-${5#*/}.levels" ;;
  *) echo "$key" >"$output" && echo '{"levels": 2, "warnings": []}' ;;
esac
"""


class EngineTest(WorkflowTest):
    """What runs, and what does not, with a program that does nothing."""

    def setUp(self):
        self.program = write_program(self.folder / "pretender", PRETENDER)
        for name, side in (("a", 10), ("b", 10), ("large", 200)):
            (self.captures / name).mkdir()
            camera = {"width": side, "height": side}
            (self.captures / name / "capture.json").write_text(json.dumps({"camera": camera}), encoding="utf-8")
        self.results.mkdir()

    def run_with(self, *options, fails="", changed=(), status=0):
        """Runs with failures, after changes of captures. Returns the jobs."""
        (self.results / "fails").write_text(fails, encoding="utf-8")
        for name in changed:
            manifest = self.captures / name / "capture.json"
            os.utime(manifest, (1e9, manifest.stat().st_mtime - 1000))
        return self.workflow(*options, status=status, program=self.program)

    def states(self):
        """The statuses of a, b and large."""
        return [row["status"] for _, row in sorted(self.report().items())]

    def test_the_engine(self):
        large = [f"large: {stage}" for stage in STAGES]
        everything = ["a: recover", "b: recover", *large]
        self.assertEqual(self.run_with(), everything)
        self.assertEqual(self.run_with(), [])

        with self.subTest("a dry run deletes nothing; the next run makes the lost file"):
            (self.results / "a.ltm").unlink()
            self.run_with("-n")
            self.assertTrue((self.results / "a.result.json").exists())
            self.assertEqual(self.run_with(), ["a: recover"])

        with self.subTest("a file with an older date is noticed; the file of a capture that fails is set aside"):
            self.assertEqual(self.run_with(fails="a 2\n", changed=["a"]), ["a: recover"])
            self.assertEqual(self.states(), ["failed", "recovered", "recovered"])
            self.assertFalse((self.results / "a.ltm").exists() or (self.results / "a.png").exists())
            self.assertTrue((self.results / "previous/a.ltm").exists() and (self.results / "previous/a.png").exists())

        with self.subTest("options that no capture allows fail the run"):
            self.run_with(fails="a 2\nb 2\nplan 2\n", changed=["a", "b", "large"], status=1)
            self.assertEqual(self.states(), ["failed"] * 3)

        with self.subTest("without its result a failed capture runs again, its failed stages as well"):
            (self.results / "large.result.json").unlink()
            self.run_with(fails="learn 65\n")
            self.assertEqual(self.report()["large"]["exit_status"], "65")
            (self.results / "large.result.json").unlink()
            self.assertEqual(self.run_with(), large)

        with self.subTest("a temporary failure shows the last error, of any stage"):
            self.run_with(fails="tiles 75\nb 101\n", changed=["a", "b", "large"], status=1)
            self.assertEqual(self.states(), ["recovered", "unfinished", "unfinished"])
            self.assertEqual([self.report()[name]["exit_status"] for name in ("b", "large")], ["101", "75"])
            self.run_with()
            self.assertEqual(self.states(), ["recovered"] * 3)
            self.assertEqual(list(self.results.glob("logs/*/*.temporary.json")), [])

        with self.subTest("after a change of options all runs again"):
            self.config = (f"options={OPTIONS} --quality 20",)
            self.assertEqual(self.run_with(), everything)


class LauncherTest(WorkflowTest):
    """pkg-scripts/cluster before Snakemake has captures."""

    def start(self, flock, *options):
        """Starts it with a flock that ends with a status. Returns what it says on standard error."""
        write_program(self.folder / "flock", f"#!/bin/sh\nexit {flock}\n")
        environment = os.environ | {"LTM_EXPORT": "true", "PATH": f"{self.folder}:{os.environ['PATH']}"}
        ended = subprocess.run(self.command(*options), env=environment, capture_output=True, text=True, timeout=SECONDS)
        self.assertEqual(ended.returncode, 1)
        return ended.stderr

    def test_only_a_lock_that_is_held_stops_a_run(self):
        held = self.start(1)
        self.assertIn("another run writes there", held)
        self.assertNotIn("holds no capture", held)
        without = self.start(71, "--resources", "gpu=1", "mem_mb=500")
        self.assertIn("its file system has no locks (flock ended with status 71)", without)
        self.assertIn("holds no capture", without)

    def test_a_wrong_field_of_the_configuration_is_named(self):
        for setting, message in (
            ("thread=2", "Additional properties are not allowed ('thread' was unexpected); docs/cluster.md"),
            ("threads=two", "threads: 'two' is not of type 'integer'; docs/cluster.md"),
        ):
            said = self.start(71, "--config", f"captures={self.captures}", setting)
            self.assertIn(f"configuration: {message}", said)
            self.assertNotIn("Failed validating", said)


class ArrayTest(unittest.TestCase):
    """array.sbatch, with a command in place of sbatch."""

    def test_the_jobs_run_in_any_posix_shell(self):
        folder = Path(tempfile.mkdtemp(prefix="cluster-test-"))
        self.addCleanup(shutil.rmtree, folder)
        name = "it's \u00fc\tb"
        (folder / name).mkdir()
        # Runs the job at once. The program writes its threads and arguments to a file.
        sbatch = '#!/bin/sh\nfor a; do case $a in --wrap=*) sh -c "${a#--wrap=}" ;; esac; done\necho 1\n'
        program = f'#!/bin/sh\nprintf "%s|" "$RAYON_NUM_THREADS" "$@" >>"{folder}/calls"\n'
        for file, content in (("sbatch", sbatch), ("it's", program)):
            write_program(folder / file, content)
        environment = {"PATH": f"{folder}:{os.environ['PATH']}", "LTM_EXPORT": str(folder / "it's")}
        environment |= {"SLURM_CPUS_PER_TASK": "3", "SLURM_ARRAY_TASK_ID": "2", "OPTIONS": "--window 7", "MEMORY": "2G"}
        command = [REPO / "workflow/array.sbatch", folder / name, folder / f"{name}.ltm"]
        for shards in ("0", "257", "1/4"):
            refused = subprocess.run([*command, shards], env=environment, capture_output=True, text=True, timeout=60)
            self.assertEqual((refused.returncode, (folder / "calls").exists()), (2, False))
            self.assertIn(f"from 1 to 256, not {shards}", refused.stderr)
        subprocess.run([*command, "4"], env=environment, check=True, capture_output=True, timeout=60)
        stages = f"{folder.resolve()}/{name}-stages"
        calls = f"3|stage|plan|{folder.resolve()}/{name}|--window|7|-o|{stages}|3|stage|learn|--memory|2G|{stages}|"
        calls += f"3|stage|tiles|{stages}|--memory|2G|--shard|2/4|3|stage|levels|{stages}|--memory|2G|--shard|2/4|"
        calls += f"3|stage|assemble|{stages}|--memory|2G|--shards|4|-o|{folder.resolve()}/{name}.ltm|"
        self.assertEqual((folder / "calls").read_text(encoding="utf-8"), calls)


class DriverTest(unittest.TestCase):
    """run_command.py: what is repeated, and what is not."""

    def run_script(self, script, *options):
        """Runs a shell script as a job. Returns the job's exit status and the folder with its files."""
        ended, folder = self.run_job(["sh", "-c", script], *options)
        return ended.returncode, folder

    def run_job(self, program, *options, environment=None):
        """Runs a program as a job. Returns how the job ended and the folder with its files."""
        folder = Path(tempfile.mkdtemp(prefix="cluster-test-"))
        self.addCleanup(shutil.rmtree, folder)
        files = ["--result", folder / "result.json", "--log", folder / "x.log"]
        command = [sys.executable, REPO / "workflow/scripts/run_command.py", "--name", "x", *files, *options]
        command += ["--", *program]
        job = {"env": environment, "stderr": subprocess.PIPE, "text": True, "timeout": 60}
        return subprocess.run(list(map(str, command)), **job), folder

    def test_permanent_failures_are_results(self):
        for status in (1, 2, 65):
            ended, folder = self.run_script(f"echo 'error: x.png: is cut off' >&2; exit {status}")
            result = json.loads((folder / "result.json").read_text())
            self.assertEqual((ended, result["status"], result["exit_status"]), (0, "failed", status))
            self.assertEqual(result["error"], "x.png: is cut off")

    def test_the_error_is_the_last_message_with_its_lines(self):
        for script, error in (
            ("echo 'warning: no error: here' >&2; exit 1", "ended with exit status 1 and without an error message"),
            ("printf 'error: first\\nerror: a: error: b\\n  c\\n' >&2; exit 1", "a: error: b\n  c"),
        ):
            _, folder = self.run_script(script)
            self.assertTrue(json.loads((folder / "result.json").read_text())["error"].startswith(error))

    def test_a_checkpoint_of_other_options_is_given_up(self):
        checkpoint = Path(tempfile.mkdtemp(prefix="cluster-test-")) / "x.ltm.checkpoint"
        self.addCleanup(shutil.rmtree, checkpoint.parent)
        checkpoint.touch()
        ended, folder = self.run_script(f"test ! -e '{checkpoint}'", "--checkpoint", checkpoint)
        result = json.loads((folder / "result.json").read_text())
        self.assertEqual((ended, result["status"]), (0, "done"))

    def test_a_program_that_cannot_be_run_is_named(self):
        ended, folder = self.run_job(["/missing/ltm-export", "recover"])
        self.assertEqual(ended.returncode, 75)
        message = r"/missing/ltm-export: cannot be run on .+: No such file or directory; put it at the same path"
        self.assertRegex(json.loads((folder / "x.temporary.json").read_text())["error"], message)
        self.assertRegex(ended.stderr, f"x: {message}")

    def test_temporary_failures_fail_the_job(self):
        cases = {
            "exit 75": (75, "ended with exit status 75"),
            "exit 101": (101, "ended with exit status 101"),
            "exit 130": (130, "ended with exit status 130"),
            "kill -9 $$": (-9, "ended by signal 9; is memory_mb too low?"),
            "kill $$": (-15, "ended by signal 15"),
        }
        for script, (status, error) in cases.items():
            ended, folder = self.run_script(script)
            self.assertNotEqual(ended, 0)
            self.assertFalse((folder / "result.json").exists())
            result = json.loads((folder / "x.temporary.json").read_text())
            self.assertEqual(result["exit_status"], status)
            self.assertTrue(result["error"].startswith(error), result["error"])

    def test_a_step_of_an_allocation_ends_as_its_command(self):
        folder = Path(tempfile.mkdtemp(prefix="cluster-test-"))
        self.addCleanup(shutil.rmtree, folder)
        write_program(folder / "srun", SRUN)
        environment = os.environ | {"PATH": f"{folder}:{os.environ['PATH']}", "SLURM_JOB_NUM_NODES": "2"}
        environment |= {"CALLS": str(folder / "calls"), "SLURM_MEM_PER_CPU": "100"}
        cases = {
            "echo 'error: x.png: is cut off' >&2; exit 65": ("failed", 65, "x.png: is cut off"),
            "echo 'error: disk full' >&2; exit 75": ("unfinished", 75, "disk full"),
            "exit 137": ("unfinished", -9, "ended by signal 9; is memory_mb too low[?]"),
            # srun's own failure.
            "exit 1": ("unfinished", 75, "n1: task 0: Exited with exit code 1; see .*"),
            "exit 0": ("done", 0, "None"),
        }
        for script, expected in cases.items():
            job = ["sh", "-c", script]
            _, files = self.run_job(job, "--cores", "3", "--memory-mb", "500", environment=environment)
            (path,) = files.glob("*.json")
            result = json.loads(path.read_text())
            self.assertEqual((result["status"], result["exit_status"]), expected[:2])
            self.assertRegex(str(result["error"]), f"^{expected[2]}$")
            called = (folder / "calls").read_text(encoding="utf-8").splitlines()[-1]
            self.assertRegex(called, "--nodes=1 --ntasks=1 --exact --cpus-per-task=3 --mem=500M .*sh -c")


# Stands for Slurm's program: runs the command, and says how it failed.
SRUN = """#!/bin/sh
echo "$*" >>"$CALLS"
[ -z "$SLURM_MEM_PER_CPU" ] || exit 77
while [ "$1" != sh ]; do shift; done
"$@"
status=$?
[ $status = 0 ] || echo "srun: error: n1: task 0: Exited with exit code $status" >&2
exit $status
"""


class CollectionFileTest(unittest.TestCase):
    """The list of captures."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="cluster-test-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def test_a_csv_file_names_captures_with_options(self):
        path = self.folder / "list.csv"
        path.write_text("name,capture,options\nb,shoot 2,--quality 40\na,../a,\n", encoding="utf-8")
        first, second = read_collection(path)
        self.assertEqual((first.name, first.folder), ("a", (self.folder.parent / "a").resolve()))
        self.assertEqual((second.folder.name, second.options), ("shoot 2", "--quality 40"))

    def test_errors_name_the_line_and_the_field(self):
        path = self.folder / "list.csv"
        cases = {
            "name,folder\na,b\n": "the first line must name the columns",
            "name;capture\na;b\n": "not 'name;capture'; separate them by commas",
            "name,capture,options\na,b,--memory=2G\n": "line 2: options: --memory=2G: the workflow gives this option",
            "name,capture\n": "names no capture",
            "name,capture\n../a,b\n": "line 2: name: '../a'",
            "name,capture\na,b\na,c\n": "line 3: name: a is there twice",
            "name,capture\na\n": "line 2: has not as many fields",
            "name,capture\na,\n": "line 2: capture: is empty",
            "name,capture,options\na,b,'\n": "line 2: options: No closing quotation",
            "name,capture\na,b\nc,'d\n\"e,f\n": "line 4: unexpected end of data; correct the quotes",
            'name,capture\n"a,b",c\n': "line 2: name: 'a,b'",
            b"name,capture\na,b\n\xfcber,c\n": "line 3: is not in UTF-8; save",
        }
        for text, message in cases.items():
            path.write_bytes(text if isinstance(text, bytes) else text.encode())
            with self.assertRaisesRegex(CollectionError, re.escape(message)):
                read_collection(path)

    def test_folders_without_captures_are_named(self):
        for name in ("a", "b", ".hidden"):
            (self.folder / name).mkdir()
        (self.folder / "a/capture.json").touch()
        (self.folder / "notes.txt").touch()
        self.assertEqual(folders_without_captures(self.folder), ["b"])
        self.assertEqual(folders_without_captures(self.folder / "a"), [])

    def test_names_are_composed_as_on_linux_and_macos(self):
        decomposed = self.folder / "Fu\u0308ssen"
        decomposed.mkdir()
        (decomposed / "capture.json").touch()
        (capture,) = read_collection(self.folder)
        self.assertEqual((capture.name, capture.folder), ("F\u00fcssen", decomposed.resolve()))
        (self.folder / "F\u00fcssen").mkdir()
        (self.folder / "F\u00fcssen/capture.json").touch()
        with self.assertRaisesRegex(CollectionError, "the same name in other code points"):
            read_collection(self.folder)

    def test_the_fingerprint_changes_with_names_sizes_and_dates(self):
        (self.folder / "capture.json").write_text('{"shots": ["a.png"]}', encoding="utf-8")
        photograph = self.folder / "a.png"
        prints = []
        for content, date in (("a", 2000), ("a", 1000), ("ab", 1000), (None, 0)):
            if content:
                photograph.write_text(content, encoding="utf-8")
                os.utime(photograph, (date, date))
            else:
                photograph.unlink()
            prints.append(Capture("a", self.folder).fingerprint)
        self.assertEqual(len(set(prints)), 4)
        self.assertEqual(Capture("a", self.folder).fingerprint, prints[-1])


class EngineTimingTest(unittest.TestCase):
    """How often Slurm is asked for the state of jobs."""

    def test_the_interval_is_bounded(self):
        class Executor:
            workflow = mock.Mock()
            workflow.remote_execution_settings.seconds_between_status_checks = 30
            interval = 3

            @property
            def next_seconds_between_status_checks(self):
                return self.interval

            @next_seconds_between_status_checks.setter
            def next_seconds_between_status_checks(self, value):
                self.interval = value

        bound_status_interval(Executor)
        executor, intervals = Executor(), []
        for _ in range(5):
            intervals.append(executor.next_seconds_between_status_checks)
            executor.next_seconds_between_status_checks += 10
        self.assertEqual(intervals, [3, 13, 23, 30, 30])


class PageTest(unittest.TestCase):
    """The page under a strict content security policy."""

    def test_the_page_has_no_inline_code(self):
        row = {"name": "<b>", "status": "failed", "exit_status": 65, "error": 'a "photo"', "warnings": []}
        row |= {"snr_db": None, "bytes": None, "seconds": 1.0, "file": None, "picture": None}
        html = page([row])
        self.assertIn("&lt;b&gt;", html)
        self.assertNotRegex(html, r"<script(?![^>]*src=)|<style| style=| on\w+=|<b>")
        self.assertNotIn("module", html, "browsers load no modules from file: addresses")
        self.assertRegex(html, r"<main>(?s:.)*<caption(?s:.)*</main>")
        self.assertEqual(html.count('aria-sort="ascending"'), 1)

    def test_the_end_of_a_run_names_ten_failures(self):
        results = [{"name": f"c{i}", "status": "failed", "error": "a.png: is cut off\nmore"} for i in range(12)]
        results[0] |= {"status": "recovered", "error": None}
        lines = failures(results)
        self.assertEqual((lines[0], lines[-1], len(lines)), ("  c1: a.png: is cut off", "  and 1 more", 11))


class OtherSlurmTest(unittest.TestCase):
    """A machine that belongs to a real cluster."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="cluster-test-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.configuration = self.folder / "slurm.conf"
        self.enter(mock.patch.object(two_node_slurm, "CONF", self.configuration))
        self.enter(mock.patch.object(two_node_slurm.os, "getuid", return_value=0))
        self.enter(mock.patch.object(two_node_slurm.shutil, "which", return_value="/usr/bin/apt-get"))
        self.commands = self.enter(mock.patch.object(two_node_slurm.subprocess, "run"))

    def enter(self, patch):
        """Patches until the test ends."""
        self.addCleanup(patch.stop)
        return patch.start()

    def test_another_clusters_jobs_and_configuration_stay(self):
        self.configuration.write_text("ClusterName=production\n", encoding="utf-8")
        slurm = TwoNodeSlurm(self.folder)
        with self.assertRaisesRegex(SlurmUnavailable, "is another cluster's"):
            slurm.start()
        slurm.close()
        self.commands.assert_not_called()
        self.assertEqual(self.configuration.read_text(encoding="utf-8"), "ClusterName=production\n")

    def test_a_configuration_that_was_replaced_stays(self):
        slurm = TwoNodeSlurm(self.folder)
        slurm.settings = two_node_slurm.MARK + "ClusterName=test\n"
        self.configuration.write_text("ClusterName=production\n", encoding="utf-8")
        slurm.close()
        self.commands.assert_not_called()
        self.assertTrue(self.configuration.exists())
        self.configuration.write_text(slurm.settings, encoding="utf-8")
        slurm.close()
        self.commands.assert_called_once_with(["scancel", "--user=root"], capture_output=True)
        self.assertFalse(self.configuration.exists())


class GigapixelTest(unittest.TestCase):
    """A picture of 32,768 x 32,768 pixels."""

    def test_assemble_needs_less_than_100_mb(self):
        with tempfile.TemporaryDirectory(prefix="gigapixel-test-") as folder:
            report = Path(folder) / "report.json"
            bench = [REPO / "pkg-scripts/bench", "gigapixel", "--report", report]
            bench += ["--side", "0", "--tiles", "65536", "--patterns", "16"]
            environment = os.environ | {"LTM_EXPORT": PROGRAM}
            command = ["timeout", "-k", "5", str(4 * SECONDS), *bench]
            ended = subprocess.run(command, env=environment, capture_output=True, text=True)
            self.assertEqual(ended.returncode, 0, ended.stderr[-3000:])
            figures = json.loads(report.read_text(encoding="utf-8"))["assemble"]
        self.assertLess(figures["memory_bytes"], 100e6)


class FullDiskTest(WorkflowTest):
    """A disk without space: a small file system in memory."""

    def setUp(self):
        self.results.mkdir(exist_ok=True)
        mount = ["mount", "-t", "tmpfs", "-o", "size=100m", "tmpfs", str(self.results)]
        if subprocess.run(mount, capture_output=True).returncode != 0:
            if os.environ.get("CI"):
                self.fail("a small file system cannot be mounted")
            self.skipTest("a small file system cannot be mounted")
        self.addCleanup(subprocess.run, ["umount", str(self.results)])

    def test_a_run_continues_once_there_is_space(self):
        simulate(self.captures / "small", 2)
        program = write_program(self.folder / "ltm-export", FILLS_DISK.replace("PROGRAM", PROGRAM))
        environment = os.environ | {"LTM_EXPORT": str(program)}
        ended = subprocess.run(self.command(), env=environment, capture_output=True, text=True, timeout=SECONDS)
        self.assertEqual(ended.returncode, 1)
        self.assertRegex(ended.stderr, r"(?m)^small: no space is left on the disk of ")
        (self.results / "filler").unlink()
        self.assertEqual(self.workflow(), ["small: recover"])
        self.assert_recovered("small")

    def test_a_stage_succeeds_once_there_is_space(self):
        capture = self.captures / "large"
        simulate(capture, 1, "256x256")
        stages, file = self.results / "stages", self.results / "large.ltm"
        copy, recovered = self.results / "copy", self.folder / "recovered.ltm"
        ltm_export("recover", capture, "-o", recovered, *OPTIONS.split())
        for command, again, output in (
            (["stage", "ingest", capture, "-o", copy], [], copy / "photos/0005.tif"),
            (["stage", "plan", copy, "-o", stages, *OPTIONS.split()], [], stages / "plan.json"),
            (["stage", "learn", stages], [], stages / "learned.bin"),
            (["stage", "tiles", stages, "--shard", "1/1"], [], stages / "shards/1-of-1.pack"),
            (["stage", "levels", stages, "--shard", "1/1"], [], stages / "shards/1-of-1.levels"),
            (["stage", "assemble", stages, "--shards", "1", "-o", file], [], file),
            (["recover", capture, "-o", file, *OPTIONS.split()], ["--resume"], file),
        ):
            with self.subTest(output.name):
                file.unlink(missing_ok=True)
                self.fails_without_space(command)
                _, written = bytes_read_and_written([PROGRAM, *command])
                expected = output.read_bytes()
                shutil.rmtree(copy) if output.is_relative_to(copy) else output.unlink()
                # The disk is full when half of all that it writes is written.
                self.fails_without_space(command, spare=written // 2)
                ltm_export(*command, *again)
                self.assertEqual(output.read_bytes(), expected)
                if output == file:
                    self.assertEqual(expected, recovered.read_bytes())

    def fails_without_space(self, command, spare=0):
        """Runs a command while so many bytes are free, or less than a page: folders take none."""
        filler = self.results / "filler"
        filler.write_bytes(bytes(shutil.disk_usage(self.results).free - spare))
        ended = subprocess.run([PROGRAM, *map(str, command)], capture_output=True, text=True)
        self.assertEqual(ended.returncode, 75, f"{command}: {ended.stderr}")
        self.assertIn("No space left on device", ended.stderr)
        filler.unlink()


# Fills the disk before it recovers.
FILLS_DISK = """#!/bin/sh
[ "$1" != recover ] || cat /dev/zero >>filler 2>/dev/null
exec 'PROGRAM' "$@"
"""


# Ends the first `learn` with a temporary failure.
FAILS_ONCE = """#!/bin/sh
if [ "$1 $2" = "stage learn" ] && [ ! -e failed-once ]; then
  touch failed-once
  exit 75
fi
exec 'PROGRAM' "$@"
"""


# Writes on which node each stage runs.
NODE_RECORDER = """#!/bin/sh
[ "$1" != stage ] || echo "$SLURMD_NODENAME $2" >>nodes
exec 'PROGRAM' "$@"
"""


class SlurmTest(WorkflowTest):
    """Slurm with two nodes, on this machine."""

    def setUp(self):
        self.slurm = TwoNodeSlurm(self.folder / self.id().split(".")[-1])
        self.addCleanup(self.slurm.close)
        try:
            self.slurm.start()
        except SlurmUnavailable as error:
            # With CI set, a Slurm that is missing is an error.
            if os.environ.get("CI"):
                raise
            self.skipTest(f"Slurm: {error}")

    def test_snakemake_and_the_array_give_the_bytes_of_recover(self):
        simulate(self.captures / "large", 1, THREE_ROWS)
        for seed in (2, 3, 4):
            simulate(self.captures / f"c{seed}", seed)
        photograph = self.captures / "c3/photos/0005.png"
        photograph.write_bytes(photograph.read_bytes()[:1000])
        program = write_program(self.folder / "ltm-export", FAILS_ONCE.replace("PROGRAM", PROGRAM))
        self.workflow(*SNAKEMAKE_OPTIONS, "--group-components", "captures=2", program=program)
        self.assert_recovered("large", "c2", "c4")
        self.assertEqual(self.report()["c3"]["exit_status"], "65")
        # The job of plan and learn was repeated.
        self.assertTrue((self.results / "failed-once").exists())
        # One job has two captures, and the sum of their times; plan and learn have that of one job.
        jobs = subprocess.run(["scontrol", "show", "job"], check=True, capture_output=True, text=True).stdout
        limits = re.findall(r"TimeLimit=(\S+)", jobs)
        self.assertEqual((limits.count("08:00:00"), set(limits)), (1, {"04:00:00", "08:00:00"}))

        array = self.folder / "array.ltm"
        self.await_success(self.submit_array(self.captures / "large", array, 3)[-1])
        self.assertEqual(array.read_bytes(), (self.results / "large.ltm").read_bytes())

    def test_an_allocation_of_two_nodes(self):
        """Jobs of the workflow run on both nodes; a capture at fault fails by its error."""
        self.captures, self.results = self.folder / "allocation-captures", self.folder / "allocation-results"
        self.captures.mkdir()
        simulate(self.captures / "allocated", 5, THREE_ROWS)
        simulate(self.captures / "at fault", 6)
        photograph = self.captures / "at fault/photos/0005.png"
        photograph.write_bytes(photograph.read_bytes()[:1000])
        program = write_program(self.folder / "node-recorder", NODE_RECORDER.replace("PROGRAM", PROGRAM))
        log = self.folder / "allocation.log"
        status = run_in_allocation(self.command(), 2, log, SECONDS, os.environ | {"LTM_EXPORT": str(program)})
        self.assertEqual(status, 0, log.read_text(encoding="utf-8")[-6000:])
        self.assert_recovered("allocated")
        failed = self.report()["at fault"]
        self.assertEqual(failed["exit_status"], "65")
        self.assertIn("photos/0005.png", failed["error"])
        self.assertNotIn("srun", failed["error"])
        steps = [line.split() for line in (self.results / "nodes").read_text(encoding="utf-8").splitlines()]
        self.assertEqual({node for node, stage in steps if stage == "tiles"}, {"n1", "n2"})

    def test_a_lost_node(self):
        """Its daemon, the job's daemon and the job are killed: the shard continues on the other node."""
        running = self.shard_on_a_node()
        self.slurm.kill_node(running.node)
        for pid in (*processes(f"slurmstepd: [{running.job}."), *running.pids()):
            os.kill(pid, signal.SIGKILL)
        self.await_success(running.assemble)
        self.assertIn("resuming with", running.log())
        self.assertEqual(running.file.read_bytes(), running.expected)

    def test_two_writers(self):
        """Only the node's daemon is killed: Slurm starts the shard again while the first process lives."""
        running = self.shard_on_a_node()
        (first,) = running.pids()
        self.slurm.kill_node(running.node)
        os.kill(first, signal.SIGSTOP)
        wait_until(lambda: len(running.pids()) == 2, SECONDS)
        os.kill(first, signal.SIGCONT)
        self.await_success(running.assemble)
        wait_until(lambda: not running.pids(), SECONDS)
        self.assertEqual(running.file.read_bytes(), running.expected)
        shards = sorted(path.name for path in (running.stages / "shards").iterdir())
        self.assertEqual(shards, ["1-of-2.levels", "1-of-2.pack", "2-of-2.levels", "2-of-2.pack"])

    def submit_array(self, capture, file, shards):
        """Submits a capture. Returns the numbers of the jobs."""
        command = [str(REPO / "workflow/array.sbatch"), str(capture), str(file), str(shards)]
        environment = os.environ | {"LTM_EXPORT": PROGRAM, "OPTIONS": OPTIONS}
        jobs = subprocess.run([*command, "--mem=1500"], check=True, env=environment, capture_output=True, text=True)
        return re.findall(r"\d+", jobs.stdout.split(";")[0])

    def await_success(self, job):
        """Waits for the end of a job."""
        wait_until(lambda: job_state(job) not in ("PENDING", "RUNNING", "COMPLETING"), SECONDS)
        self.assertEqual(job_state(job), "COMPLETED")

    def shard_on_a_node(self):
        """Submits a capture in two shards, and waits until tiles of the first are recovered."""
        folder = self.folder / f"{self.id().split('.')[-1]}-files"
        folder.mkdir()
        running = RunningShard(folder)
        *_, tiles, _, running.assemble = self.submit_array(running.capture, running.file, 2)
        partial = running.stages / "shards"
        # Two whole tiles at least: of one, a process that is killed may have written a part.
        wait_until(lambda: any(path.stat().st_size > 600_000 for path in partial.glob("1-of-2.*.partial")), SECONDS)
        # Each shard is a job of its own, with a node.
        question = ["squeue", "-h", "-j", f"{tiles}_1", "-o", "%A %N"]
        running.job, running.node = subprocess.run(question, capture_output=True, text=True).stdout.split()
        return running


class RunningShard:
    """The first of two shards, while it runs on a node."""

    def __init__(self, folder):
        self.capture, self.file = folder / "large", folder / "large.ltm"
        simulate(self.capture, 1, "256x256")
        self.stages = folder / "large-stages"
        self.node = self.job = self.assemble = None
        recovered = folder / "recovered.ltm"
        ltm_export("recover", self.capture, "-o", recovered, *OPTIONS.split())
        self.expected = recovered.read_bytes()

    def pids(self):
        """Its processes: one for each time that Slurm started it."""
        arguments = ("stage", "tiles", str(self.stages), "--shard", "1/2")
        return processes("\0".join(arguments), PROGRAM)

    def log(self):
        """What the processes printed."""
        return "".join(path.read_text(encoding="utf-8") for path in (self.stages / "logs").glob("slurm-*_1.out"))


def job_state(job):
    """State of a job of Slurm."""
    answer = subprocess.run(["scontrol", "show", "job", job], capture_output=True, text=True)
    return re.search(r"JobState=(\w+)", answer.stdout)[1]


def processes(text, program=""):
    """Process ids of commands with a text in their arguments, of this program."""
    commands = [(path.parent.name, read_bytes(path)) for path in Path("/proc").glob("[0-9]*/cmdline")]
    commands = [(pid, command) for pid, command in commands if command.startswith(program.encode())]
    return [int(pid) for pid, command in commands if text.encode() in command]


def read_bytes(path):
    """The bytes of a file that may vanish."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


if __name__ == "__main__":
    unittest.main(verbosity=2)
