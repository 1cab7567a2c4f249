"""Writes the page and the table of a collection's results: index.html, page.css, table.js and report.csv."""

import csv
import json
import os
import shutil
import sys
from html import escape
from pathlib import Path
from urllib.parse import quote

from captures import read_collection

PAGE = Path(__file__).resolve().parent.parent / "page"
CSV_COLUMNS = ["name", "status", "exit_status", "error", "snr_db", "bytes", "seconds", "warnings", "capture"]
# Printed at the end of a run; report.csv has all.
MAX_FAILURES = 10
STATUSES = ["recovered", "failed", "unfinished"]
HEADS = ["Photograph", "Status", "SNR (dB)", "Size (kB)", "Time (s)", "Warnings", "Message"]


def read_results(captures, folder):
    """How the recoveries of captures ended, as rows of the table."""
    return [read_result(capture, Path(folder)) for capture in captures]


def write_page(results, folder):
    """Writes the page and the table into a folder."""
    folder = Path(folder)
    write_text(folder / "report.csv", report(results))
    write_text(folder / "index.html", page(results))
    for name in ("page.css", "table.js"):
        shutil.copyfile(PAGE / name, folder / name)


def read_result(capture, folder):
    """How a capture's recovery ended, as a row of the table."""
    result = read_json(folder / f"{capture.name}.result.json")
    # The result of a capture in shards stays while a stage of its next recovery fails.
    failure = last_temporary_failure(folder / "logs" / capture.name)
    if result and not failure:
        status = "recovered" if result["status"] == "done" else "failed"
    else:
        result = failure or {"error": "the job was ended from outside or has not run; run the workflow again"}
        status = "unfinished"
    recovery = result.get("report", {})
    return {
        "name": capture.name,
        "status": status,
        "exit_status": result.get("exit_status"),
        "error": result.get("error"),
        "snr_db": recovery.get("expected_snr_db"),
        "bytes": recovery.get("file_bytes"),
        "seconds": result.get("seconds"),
        "warnings": [warning["message"] for warning in recovery.get("warnings", [])],
        "capture": str(capture.folder),
        "file": result.get("file"),
        "picture": result.get("picture"),
    }


def last_temporary_failure(logs):
    """The newest temporary failure in a folder of logs; None if there is none."""
    failures = filter(None, map(read_json, sorted(logs.glob("*.temporary.json"), key=modified)))
    return next(reversed(list(failures)), None)


def modified(path):
    """When a file was written; 0 if it has vanished."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def read_json(path):
    """Reads a file of JSON; None if there is none or it is not readable."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def report(results):
    """The table as CSV."""
    lines = _Lines()
    writer = csv.DictWriter(lines, CSV_COLUMNS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for result in results:
        writer.writerow(result | {"warnings": "; ".join(result["warnings"])})
    return "".join(lines)


class _Lines(list):
    """What csv writes to."""

    write = list.append


def summary(results):
    """How many captures ended in which way."""
    counts = [sum(result["status"] == status for result in results) for status in STATUSES]
    return ", ".join(f"{count} {status}" for count, status in zip(counts, STATUSES, strict=True))


def failures(results):
    """The captures that were not recovered, one a line, with the first lines of their errors; ten at most."""
    failed = [result for result in results if result["status"] != "recovered"]
    errors = [(result["name"], (result["error"] or "").partition("\n")[0]) for result in failed[:MAX_FAILURES]]
    lines = [f"  {name}: {error}" for name, error in errors]
    return lines + ([f"  and {len(failed) - MAX_FAILURES} more"] if len(failed) > MAX_FAILURES else [])


def page(results):
    """The table as HTML. Its script is a classic one, as browsers load no modules from file:// addresses."""
    rows = "\n".join(map(row, results))
    return f"""<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>Relightable photographs</title>
<link rel="stylesheet" href="page.css">
<script src="table.js" defer></script>
<main>
<h1>Relightable photographs</h1>
<p>{summary(results)}. <a href="report.csv">report.csv</a></p>
<p id="sorting" role="status"></p>
<div class="scroll" role="region" aria-labelledby="caption" tabindex="0">
<table>
<caption id="caption">Results of all captures. The buttons in the first row sort the table.</caption>
<thead><tr>{heads()}</tr></thead>
<tbody>
{rows}
</tbody>
</table>
</div>
</main>
"""


def heads():
    """The first row. The table begins in order of names."""
    sortings = [' aria-sort="ascending"', *[""] * (len(HEADS) - 1)]
    return "".join(
        f'<th scope="col"{sorting}><button type="button">{head}</button></th>'
        for head, sorting in zip(HEADS, sortings, strict=True)
    )


def row(result):
    """A row of the table. Cells with numbers have the exact ones for sorting."""
    messages = [*([result["error"]] if result["error"] else []), *result["warnings"]]
    kilobytes = result["bytes"] / 1000 if result["bytes"] is not None else None
    cells = [
        f'<th scope="row" data-value="{escape(result["name"])}">{name_cell(result)}</th>',
        f"<td>{status_cell(result)}</td>",
        number_cell(result["snr_db"], 1),
        number_cell(kilobytes, 1),
        number_cell(result["seconds"], 1),
        number_cell(len(result["warnings"]), 0),
        f"<td>{'<br>'.join(map(escape, messages))}</td>",
    ]
    return f'<tr class="{result["status"]}">{"".join(cells)}</tr>'


def name_cell(result):
    """A file's picture and its name, with a link to the file."""
    name = escape(result["name"])
    if not result["file"]:
        return name
    picture = ""
    if result["picture"]:
        picture = f'<img src="{quote(result["picture"])}" alt="" loading="lazy" width="96"> '
    return f'<a href="{quote(result["file"])}">{picture}{name}</a>'


def status_cell(result):
    """The status, with the exit status if it says more."""
    return result["status"] + (f" ({result['exit_status']})" if result["exit_status"] else "")


def number_cell(number, digits):
    """A cell with a number, or none."""
    if number is None:
        return "<td></td>"
    return f'<td class="number" data-value="{number}">{number:,.{digits}f}</td>'


def write_text(path, text):
    """Writes a file under another name and renames it, so that it is never half written."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


if __name__ == "__main__":
    write_page(read_results(read_collection(sys.argv[1]), sys.argv[2]), sys.argv[2])
