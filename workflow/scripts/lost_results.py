"""Removes results that do not hold any more, so that Snakemake runs their jobs again."""

from pathlib import Path

from write_page import read_json

SUFFIX = ".result.json"
STAGE_FILES = {"ingest": "ingested/capture.json", "plan": "plan.json", "learn": "learned.bin"}


def remove_lost_results(name):
    """Removes the result of a capture whose file is gone.

    Without this result, also those of its stages that failed or whose file is gone.
    """
    result = Path(name + SUFFIX)
    file = (read_json(result) or {}).get("file")
    if file and not Path(file).exists():
        result.unlink()
    if not result.exists():
        for stage in Path("stages", name).glob("*" + SUFFIX):
            if is_lost(stage):
                stage.unlink()


def is_lost(path):
    """Whether a stage failed, or its file is gone."""
    stage = path.name.removesuffix(SUFFIX)
    file = path.parent / STAGE_FILES.get(stage.split("-")[0], f"shards/{stage}.pack")
    return (read_json(path) or {}).get("status") != "done" or not file.exists()
