"""Removes results that do not hold any more, so that Snakemake runs their jobs again."""

from pathlib import Path

from write_page import read_json

SUFFIX = ".result.json"
STAGE_FILES = {"ingest": "ingested/capture.json", "plan": "plan.json", "learn": "learned.bin"}


def remove_lost_results(name):
    """Removes the result of a capture whose file is gone.

    Without this result, also those of its stages that failed or whose file is gone; if there are any, those of
    ingesting as well, as a photograph of the copy may be damaged or gone.
    """
    result = Path(name + SUFFIX)
    file = (read_json(result) or {}).get("file")
    if file and not Path(file).exists():
        result.unlink()
    if not result.exists():
        stages = list(Path("stages", name).glob("*" + SUFFIX))
        if lost := {stage for stage in stages if is_lost(stage)}:
            for stage in lost.union(stage for stage in stages if stage.name.startswith("ingest-")):
                stage.unlink()


def is_lost(path):
    """Whether a stage failed, or its file is gone."""
    stage = path.name.removesuffix(SUFFIX)
    first, _, shard = stage.partition("-")
    if first == "levels":
        file = f"shards/{shard}.levels"
    else:
        file = STAGE_FILES.get(first, f"shards/{stage}.pack")
    file = path.parent / file
    return (read_json(path) or {}).get("status") != "done" or not file.exists()
