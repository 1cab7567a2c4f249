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
HEADS = ["Photograph", "Status", "SNR (dB)", "Size (kB)", "Time (s)", "Warnings", "Message"]


def write_page(captures, folder):
    """Writes the results of captures in a folder."""
    folder = Path(folder)
    results = [read_result(capture, folder) for capture in captures]
    write_text(folder / "report.csv", report(results))
    write_text(folder / "index.html", page(results))
    for name in ("page.css", "table.js"):
        shutil.copyfile(PAGE / name, folder / name)


def forget_lost_files(names):
    """Removes the results of files in the working folder that have been deleted since, so that they are made again."""
    for name in names:
        result = read_json(Path(f"{name}.result.json")) or {}
        if "file" in result and not Path(result["file"]).exists():
            os.remove(f"{name}.result.json")


def read_result(capture, folder):
    """How a capture's recovery ended, as a row of the table."""
    result = read_json(folder / f"{capture.name}.result.json")
    if result:
        status = "recovered" if result["status"] == "done" else "failed"
    else:
        result = read_json(folder / "logs" / f"{capture.name}.temporary.json") or {
            "error": "the job was ended from outside or has not run; run the workflow again",
        }
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


def page(results):
    """The table as HTML."""
    counts = {status: sum(result["status"] == status for result in results) for status in ("recovered", "failed")}
    unfinished = len(results) - sum(counts.values())
    summary = f"{counts['recovered']} recovered, {counts['failed']} failed, {unfinished} unfinished."
    heads = "".join(f'<th scope="col"><button type="button">{head}</button></th>' for head in HEADS)
    rows = "\n".join(map(row, results))
    return f"""<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Relightable photographs</title>
<link rel="stylesheet" href="page.css">
<script type="module" src="table.js"></script>
<h1>Relightable photographs</h1>
<p>{summary} <a href="report.csv">report.csv</a></p>
<p id="sorting" role="status"></p>
<table>
<thead><tr>{heads}</tr></thead>
<tbody>
{rows}
</tbody>
</table>
"""


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
    write_page(read_collection(sys.argv[1]), sys.argv[2])
