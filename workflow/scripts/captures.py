"""Reads a collection of captures: a folder of capture folders, or a CSV file."""

import csv
import hashlib
import io
import json
import os
import re
import shlex
import unicodedata
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

MANIFEST = "capture.json"
# Names become file names, and parts of Snakemake's patterns and of shell commands. Snakemake separates the wildcards of
# jobs on Slurm by commas.
NAME = re.compile(r"\w[\w .+=@-]*")
CSV_COLUMNS = {"name", "capture", "options"}
OPTIONS_OF_WORKFLOW = {"--memory", "--json", "--resume", "-o", "--output"}


class CollectionError(Exception):
    """The collection cannot be read; the message names the file, the field and the remedy."""


@dataclass(frozen=True)
class Capture:
    """A capture of the collection: its name, its folder and its options of `ltm-export recover`."""

    name: str
    folder: Path
    options: str = ""

    @cached_property
    def manifest(self):
        """What capture.json says; empty if it cannot be read, which `ltm-export` reports."""
        try:
            manifest = json.loads((self.folder / MANIFEST).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return manifest if isinstance(manifest, dict) else {}

    @property
    def camera_pixels(self):
        """Number of camera pixels; 0 if capture.json does not say it."""
        camera = self.manifest.get("camera")
        sides = [camera.get(side) for side in ("width", "height")] if isinstance(camera, dict) else [0]
        return sides[0] * sides[-1] if all(isinstance(side, int) for side in sides) else 0

    @cached_property
    def files(self):
        """capture.json and the files that it names, as far as they exist. `ltm-export` reports the others."""
        named = sorted(set(_strings(self.manifest)))
        paths = [self.folder / name for name in [MANIFEST, *named]]
        return [str(path) for path in paths if _is_file(path)]

    @cached_property
    def fingerprint(self):
        """Changes with the names, sizes and dates of the files. Snakemake itself notices only dates that are newer."""
        states = [(path, os.stat(path)) for path in self.files]
        described = [(path, state.st_size, state.st_mtime_ns) for path, state in states]
        return hashlib.sha256(json.dumps(described).encode()).hexdigest()[:16]


def read_collection(path):
    """Returns the captures of a folder or a CSV file, in order of their names."""
    path = Path(path)
    if path.is_dir():
        captures = _read_folder(path)
    elif path.is_file():
        captures = _read_csv(path)
    else:
        raise CollectionError(f"{path}: there is no such folder or CSV file; give one that holds captures")
    return sorted(captures, key=lambda capture: capture.name)


def _read_folder(folder):
    """A capture folder is a collection of one. Subfolders without capture.json are no captures."""
    if (folder / MANIFEST).exists():
        folders = [folder.resolve()]
    else:
        folders = [child for child in folder.resolve().iterdir() if (child / MANIFEST).exists()]
    if not folders:
        raise CollectionError(
            f"{folder}: holds no capture; give a capture folder, a folder of capture folders, or a CSV file"
        )
    captures = {}
    for folder in folders:
        capture = _capture_of_folder(folder)
        if capture.name in captures:
            raise CollectionError(f"{folder}: another folder has the same name in other code points; rename one")
        captures[capture.name] = capture
    return list(captures.values())


def folders_without_captures(path):
    """Names of the folders in a folder of capture folders that have no capture.json."""
    path = Path(path)
    if not path.is_dir() or (path / MANIFEST).exists():
        return []
    folders = [child for child in path.iterdir() if child.is_dir() and not child.name.startswith(".")]
    return sorted(folder.name for folder in folders if not (folder / MANIFEST).exists())


def _capture_of_folder(folder):
    """The capture of a folder, with the folder's name."""
    name = normal_name(folder.name)
    if not NAME.fullmatch(name):
        raise CollectionError(
            f"{folder}: the folder's name has characters that a result's name cannot have; "
            "rename it, or name it in a CSV file with the columns name and capture"
        )
    return Capture(name, folder)


def _read_csv(path):
    """Capture folders are relative to the folder of the CSV file."""
    rows = csv.DictReader(io.StringIO(_text(path), newline=""), strict=True)
    captures = {}
    try:
        _check_columns(path, rows.fieldnames)
        for row in rows:
            capture = _capture_of_row(path, rows.line_num, row)
            if capture.name in captures:
                raise CollectionError(f"{path}: line {rows.line_num}: name: {capture.name} is there twice; rename one")
            captures[capture.name] = capture
    except csv.Error as error:
        place = f"{path}: line {rows.reader.line_num}"
        raise CollectionError(f"{place}: {error}; correct the quotes and commas") from error
    if not captures:
        raise CollectionError(f"{path}: names no capture; add a line for each")
    return list(captures.values())


def _text(path):
    """The text of a file in UTF-8."""
    content = path.read_bytes()
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise CollectionError(f"{path}: line {line}: is not in UTF-8; save the file in this encoding") from error


def _check_columns(path, columns):
    """Checks the first line of a CSV file."""
    if not {"name", "capture"} <= set(columns or []) <= CSV_COLUMNS:
        found = ",".join(columns or [])
        remedy = "; separate them by commas" if ";" in found else ""
        columns = "the columns name and capture, and optionally options"
        raise CollectionError(f"{path}: the first line must name {columns}, not {found!r}{remedy}")


def _capture_of_row(path, line, row):
    """Checks a line of a CSV file."""
    place = f"{path}: line {line}"
    if None in row or None in row.values():
        raise CollectionError(f"{place}: has not as many fields as the first line; correct the line")
    name, folder, options = normal_name(row["name"]), row["capture"], row.get("options", "")
    if not NAME.fullmatch(name):
        raise CollectionError(
            f"{place}: name: {name!r} cannot be a file's name; use letters, digits, spaces and . + = @ _ -"
        )
    if not folder:
        raise CollectionError(f"{place}: capture: is empty; give a capture folder")
    split_options(f"{place}: options", options)
    return Capture(name, (path.parent / folder).resolve(), options)


def normal_name(name):
    """A name in composed characters (NFC): macOS gives the names of folders decomposed."""
    return unicodedata.normalize("NFC", name)


def split_options(place, options):
    """Splits options as a shell does. An error names the place."""
    try:
        parts = shlex.split(options)
    except ValueError as error:
        raise CollectionError(f"{place}: {error}; correct the quotes") from error
    for part in parts:
        if part.split("=")[0] in OPTIONS_OF_WORKFLOW:
            remedy = "set memory_mb instead" if part.startswith("--memory") else "leave it out"
            raise CollectionError(f"{place}: {part}: the workflow gives this option; {remedy}")
    return parts


def _strings(value):
    """All strings in a value of JSON."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, (list, dict)):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _strings(item)


def _is_file(path):
    """Whether this is a file; a string that cannot be a path is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
