"""Runs one command of `ltm-export` for a job, and writes how it ended as JSON.

A permanent failure (exit status 1, 2 or 65) is a result as well: the job succeeds, so that Snakemake neither repeats it
nor stops for it. Any other failure (75, a panic, an interruption, a signal) fails the job, so that Snakemake repeats
it; then the JSON is beside the log.

In a Slurm allocation of several nodes, srun runs the command on a node that has free cores.
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from socket import gethostname

FAILURE = 1
PERMANENT = (FAILURE, 2, 65)
TEMPORARY = 75
# Snakemake repeats a failed job at once.
SECONDS_UNTIL_RETRY = 5
# With less, a log may lack its last message; a program that cannot print it may even end with another status.
MIN_FREE_BYTES = 1 << 20
# The last message of a log, which may have several lines.
ERROR = re.compile(r"(?s:.*)^error: ((?s:.*))", re.MULTILINE)
# What srun adds to the log, and its last error.
OF_SRUN = re.compile(r"^(?:srun|slurmstepd): .*\n?", re.MULTILINE)
ERROR_OF_SRUN = re.compile(r"(?s:.*)^srun: error: (.*)", re.MULTILINE)
# A shell and srun add the number of a signal to it.
SIGNAL = 128


def main():
    """Runs the job. A file that cannot be written, as on a full disk, is a temporary failure."""
    args = parse_arguments()
    try:
        return run_job(args)
    except OSError as error:
        print(f"{args.name}: {error}", file=sys.stderr)
        time.sleep(SECONDS_UNTIL_RETRY)
        return TEMPORARY


def run_job(args):
    """Runs the command, unless an earlier one of the same capture failed. Returns the exit status of the job."""
    temporary = args.log.with_suffix(".temporary.json")
    temporary.unlink(missing_ok=True)
    earlier = [read_json(path) for path in args.after]
    failed = next((result for result in earlier if result["status"] == "failed"), None)
    result, output = (failed, "") if failed else run_command(args)
    if result["status"] == "unfinished":
        # For the log of the engine: the disk that fails the command may have no space for the result either.
        print(f"{args.name}: {result['error']}", file=sys.stderr)
        write_json(temporary, result)
        if result["exit_status"] == TEMPORARY:
            time.sleep(SECONDS_UNTIL_RETRY)
        return result["exit_status"] if 0 < result["exit_status"] < 126 else TEMPORARY
    if args.file:
        if not failed:
            result["seconds"] = round(sum(part["seconds"] for part in [*earlier, result]), 2)
        result |= finish_capture(args, result, output)
    write_json(args.result, result)
    if args.remove and result["status"] == "done":
        shutil.rmtree(args.remove, ignore_errors=True)
    return 0


def run_command(args):
    """Runs the command, again without its checkpoint if need be. Returns how it ended, and its standard output."""
    started = time.monotonic()
    resumes = args.checkpoint and args.checkpoint.exists()
    status, output = run(args)
    if status == FAILURE and resumes:
        # The checkpoint is of other options or photographs, or of another build of the program.
        args.checkpoint.unlink(missing_ok=True)
        status, output = run(args)
    result = {
        "name": args.name,
        "status": "done" if status == 0 else "failed" if status in PERMANENT else "unfinished",
        "exit_status": status,
        "error": reason(status, args.log) if status else None,
        "seconds": round(time.monotonic() - started, 2),
    }
    return result, output


def parse_arguments():
    """The arguments; the command follows `--`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--name", required=True, help="name of the capture")
    parser.add_argument("--result", type=Path, required=True, help="JSON file to write")
    parser.add_argument("--log", type=Path, required=True, help="file for what the command prints on standard error")
    parser.add_argument("--after", type=Path, nargs="*", default=[], help="results of commands that come before")
    parser.add_argument("--file", type=Path, help="the .ltm file that this command writes")
    parser.add_argument("--checkpoint", type=Path, help="file from which the command resumes, if it can")
    parser.add_argument("--remove", type=Path, help="folder to remove after success")
    parser.add_argument("--cores", type=int, default=1, help="cores that a step of Slurm requests")
    parser.add_argument("--memory-mb", type=int, help="memory that a step of Slurm requests, in megabytes")
    parser.add_argument("command", nargs="+")
    return parser.parse_args()


def run(args):
    """Runs the command. Returns its exit status, and what it printed on standard output."""
    if int(os.environ.get("SLURM_JOB_NUM_NODES", "1")) == 1:
        return run_process(args.command, args.log, os.environ)
    srun = ["srun", "--nodes=1", "--ntasks=1", "--exact", f"--cpus-per-task={args.cores}"]
    srun += [f"--mem={args.memory_mb}M"] if args.memory_mb else []
    # Ctrl-C ends the command at once.
    srun += ["--input=none", "--disable-status"]
    # The allocation's memory, which may be given in a way that excludes --mem.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("SLURM_MEM_PER_")}
    status, output = run_process([*srun, *args.command], args.log, environment)
    return status_of_step(status, args.log), output


def status_of_step(status, log):
    """The exit status of the command that srun ran, from that of srun; a signal is negative, as of a process.

    srun ends with the same statuses if the step cannot be started: then the command printed no error.
    """
    if status > SIGNAL:
        return SIGNAL - status
    return TEMPORARY if status in PERMANENT and not ERROR.match(read_log(log)) else status


def run_process(command, log, environment):
    """Runs a command. Returns its exit status, and what it printed on standard output.

    If the process that started this one is killed, the command is interrupted: nothing would wait for its end.
    """
    parent = os.getppid()
    # Ctrl-C reaches the command as well, which then ends in order.
    signal.signal(signal.SIGINT, lambda *_: None)
    with open(log, "w", encoding="utf-8") as errors:
        try:
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=environment)
        except OSError as error:
            remedy = "; put it at the same path on all machines" if isinstance(error, FileNotFoundError) else ""
            errors.write(f"error: {command[0]}: cannot be run on {gethostname()}: {error.strerror}{remedy}\n")
            return TEMPORARY, ""
        signal.signal(signal.SIGTERM, lambda *_: process.terminate())
        while True:
            try:
                output, _ = process.communicate(timeout=1)
                return process.returncode, output
            except subprocess.TimeoutExpired:
                if os.getppid() != parent:
                    process.terminate()


def reason(status, log):
    """Why a command failed: its last error message, or how it ended without one."""
    if status < 0:
        return f"ended by signal {-status}" + ("; is memory_mb too low?" if -status == signal.SIGKILL else "")
    message = ERROR.match(OF_SRUN.sub("", read_log(log)))
    if message:
        return message[1].strip()[:2000]
    message = ERROR_OF_SRUN.match(read_log(log))
    if message:
        return f"{message[1]}; see {log}"
    if shutil.disk_usage(log.parent).free < MIN_FREE_BYTES:
        return f"no space is left on the disk of {log.parent.absolute()}"
    return f"ended with exit status {status} and without an error message; see {log}"


def read_log(log):
    """What the command printed on standard error."""
    return log.read_text(encoding="utf-8", errors="replace")


def finish_capture(args, result, output):
    """Puts the files of a capture in order. Returns what its result says about them."""
    for temporary in args.log.parent.glob("*.temporary.json"):
        temporary.unlink(missing_ok=True)
    if result["status"] == "done":
        return finished_file(args.command[0], args.file, json.loads(output))
    set_aside(args.file)
    return {}


def set_aside(file):
    """Moves an earlier file and its picture to the folder `previous`: they are not of the capture as it is now."""
    for path in (file, file.with_suffix(".png")):
        if path.exists():
            previous = path.parent / "previous"
            previous.mkdir(exist_ok=True)
            path.replace(previous / path.name)


def finished_file(program, path, report):
    """What the page says about a finished file. A picture that cannot be made is no failure."""
    picture = path.with_suffix(".png")
    level = report["levels"] - 1
    relight = [program, "relight", path, "--light", "flood", "--level", str(level), "-o", picture]
    made = subprocess.run(relight, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    return {"file": path.name, "picture": picture.name if made else None, "report": report}


def read_json(path):
    """Reads a result."""
    return json.loads(path.read_text(encoding="utf-8"))


def write_json(path, value):
    """Writes a result under another name and renames it, so that it is never half written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_text(json.dumps(value, indent=1), encoding="utf-8")
    temporary.replace(path)


if __name__ == "__main__":
    sys.exit(main())
