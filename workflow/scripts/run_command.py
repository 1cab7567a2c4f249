"""Runs one command of `ltm-export` for a job, and writes how it ended as JSON.

A permanent failure (exit status 1, 2 or 65) is a result as well: the job succeeds, so that Snakemake neither repeats it
nor stops for it. Any other failure (75, an interruption, a signal) fails the job, so that Snakemake repeats it.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

FAILURE = 1
PERMANENT = (FAILURE, 2, 65)
TEMPORARY = 75
# Network file systems show a new file to other machines only after some seconds.
SECONDS_UNTIL_VISIBLE = 60
# Snakemake repeats a failed job at once.
SECONDS_UNTIL_RETRY = 5


def main():
    """Runs the command, unless an earlier one of the same capture failed."""
    args = parse_arguments()
    earlier = [read_json(path) for path in args.after]
    failed = next((result for result in earlier if result["status"] == "failed"), None)
    if failed:
        write_json(args.result, failed)
        return 0
    started = time.monotonic()
    missing = wait_for_files(args.needs)
    if missing:
        error = f"{missing}: is missing; delete its folder and run the workflow again"
        status, report = TEMPORARY, ""
    else:
        resumes = args.checkpoint and args.checkpoint.exists()
        status, report = run(args.command, args.log)
        if status == FAILURE and resumes:
            # The checkpoint is of other options or photographs, or of another build of the program.
            args.checkpoint.unlink(missing_ok=True)
            status, report = run(args.command, args.log)
        error = last_error(args.log) if status else None
    result = {
        "name": args.name,
        "status": "failed" if status else "done",
        "exit_status": status,
        "error": error,
        "seconds": round(time.monotonic() - started, 2),
    }
    if status not in (0, *PERMANENT):
        write_json(args.temporary, result)
        if status == TEMPORARY:
            time.sleep(SECONDS_UNTIL_RETRY)
        return status if 0 < status < 126 else TEMPORARY
    if args.file and status == 0:
        result |= finished_file(args.command[0], args.file, json.loads(report))
    if args.file:
        result["seconds"] = round(sum(part["seconds"] for part in [*earlier, result]), 2)
    write_json(args.result, result)
    if args.file:
        args.temporary.unlink(missing_ok=True)
    if args.remove and status == 0:
        shutil.rmtree(args.remove, ignore_errors=True)
    return 0


def parse_arguments():
    """The arguments; the command follows `--`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--name", required=True, help="name of the capture")
    parser.add_argument("--result", type=Path, required=True, help="JSON file to write")
    parser.add_argument("--temporary", type=Path, required=True, help="JSON file to write after a temporary failure")
    parser.add_argument("--log", type=Path, required=True, help="file for what the command prints on standard error")
    parser.add_argument("--after", type=Path, nargs="*", default=[], help="results of commands that come before")
    parser.add_argument("--needs", type=Path, nargs="*", default=[], help="files that those commands wrote")
    parser.add_argument("--file", type=Path, help="the .ltm file that this command writes")
    parser.add_argument("--checkpoint", type=Path, help="file from which the command resumes, if it can")
    parser.add_argument("--remove", type=Path, help="folder to remove after success")
    parser.add_argument("command", nargs="+")
    return parser.parse_args()


def wait_for_files(paths):
    """Waits until all files are visible. Returns the first that does not become so."""
    end = time.monotonic() + SECONDS_UNTIL_VISIBLE
    for path in paths:
        while not path.exists():
            if time.monotonic() > end:
                return path
            os.listdir(path.parent if path.parent.exists() else ".")
            time.sleep(1)
    return None


def run(command, log):
    """Runs the command. Returns its exit status, and what it printed on standard output.

    If the process that started this one is killed, the command is interrupted: nothing would wait for its end.
    """
    parent = os.getppid()
    # Ctrl-C reaches the command as well, which then ends in order.
    signal.signal(signal.SIGINT, lambda *_: None)
    with open(log, "w", encoding="utf-8") as errors:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
        signal.signal(signal.SIGTERM, lambda *_: process.terminate())
        while True:
            try:
                output, _ = process.communicate(timeout=1)
                return process.returncode, output
            except subprocess.TimeoutExpired:
                if os.getppid() != parent:
                    process.terminate()


def last_error(log):
    """The error message at the end of a log."""
    text = log.read_text(encoding="utf-8", errors="replace")
    _, found, error = text.rpartition("error: ")
    return error.strip()[:2000] if found else "the command ended without an error message"


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
