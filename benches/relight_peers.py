"""Times scipy on the problem that benches/relight.rs writes.

python relight_peers.py FOLDER RUNS

Prints {name: milliseconds a frame of three channels} of the N x M matrix times the light, and of the
light times its M x N transpose, both stored row by row. Leaves their pictures in FOLDER.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import scipy.sparse


def fastest(runs, multiply):
    """Milliseconds of the fastest run, and its product."""
    best = np.inf
    for _ in range(runs):
        start = time.perf_counter()
        product = multiply()
        best = min(best, time.perf_counter() - start)
    return best * 1e3, product


def main():
    folder, runs = Path(sys.argv[1]), int(sys.argv[2])
    begins = np.fromfile(folder / "begins.i32", "<i4")
    indices = np.fromfile(folder / "indices.i32", "<i4")
    times = {"scipy_csr": 0.0, "scipy_csr_transposed": 0.0}
    pictures = {name: [] for name in times}
    # One channel at a time, as a matrix and its transpose of all three take much memory; a frame is the
    # sum of the channels' fastest.
    for channel in range(3):
        values = np.fromfile(folder / f"values{channel}.f32", "<f4")
        light = np.fromfile(folder / f"light{channel}.f32", "<f4")
        shape = (len(begins) - 1, len(light))
        matrix = scipy.sparse.csr_array((values, indices, begins), shape=shape)
        transpose = matrix.T.tocsr()
        for name, multiply in [
            ("scipy_csr", lambda: matrix @ light),
            ("scipy_csr_transposed", lambda: light @ transpose),
        ]:
            ms, picture = fastest(runs, multiply)
            times[name] += ms
            pictures[name].append(picture)
    for name, picture in pictures.items():
        np.array(picture, "<f4").tofile(folder / f"{name}.f32")
    print(json.dumps(times))


if __name__ == "__main__":
    main()
