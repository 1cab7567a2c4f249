"""Times peers on the problems that benches/recover.rs writes, and holds our answers against theirs.

python recover_peers.py nnls|bpdn PROBLEMS.f64 L S RIGHT_HAND_SIDES

Prints {peer: {"seconds": a right-hand side, "objective": worst ratio of ours to the peer's}}.
"""

import json
import sys
import time
import warnings

import numpy as np

RUNS = 3


def read(path, patterns, elements, sides):
    """Yields A [L, S], Y [sides, L] and our X [sides, S] of each window."""
    data = np.fromfile(path, "<f8")
    per_window = patterns * elements + sides * (patterns + elements)
    for window in data.reshape(-1, per_window):
        a = window[: patterns * elements].reshape(patterns, elements)
        rest = window[patterns * elements :].reshape(sides, patterns + elements)
        yield np.ascontiguousarray(a), rest[:, :patterns].copy(), rest[:, patterns:].copy()


def fastest(solve, problems):
    """Seconds a problem in the fastest of some runs, and the last run's answers."""
    best = np.inf
    for _ in range(RUNS):
        start = time.perf_counter()
        answers = [solve(*problem) for problem in problems]
        best = min(best, time.perf_counter() - start)
    return best / len(problems), answers


def nnls(windows):
    import scipy.optimize

    problems = [(a, y) for a, ys, _ in windows for y in ys]
    ours = [x for _, _, xs in windows for x in xs]
    seconds, theirs = fastest(lambda a, y: scipy.optimize.nnls(a, y)[0], problems)
    ratios = []
    for (a, y), x, peer in zip(problems, ours, theirs):
        # Some functions can be fitted exactly, and ours are kept in single precision: far below the
        # noise, at a ten-thousandth of the signal, no residual is better than another.
        least = 1e-4 * np.linalg.norm(y)
        here, there = np.linalg.norm(y - a @ x), np.linalg.norm(y - a @ peer)
        ratios.append((here + least) / (there + least))
    return {"scipy": {"seconds": seconds, "objective": max(ratios)}}


def bpdn(windows):
    from sklearn.linear_model import Lasso, lars_path, lars_path_gram

    problems, ours = [], []
    for a, ys, xs in windows:
        gram = a.T @ a
        fortran = np.asfortranarray(a)
        for y, x in zip(ys, xs):
            h = a.T @ y
            # Where the constraint cannot be met, ours is the least-squares end of the path, λ = 0,
            # which Lasso does not do: those are few and left out, as is a pixel that is black.
            strength = (h - gram @ x).max()
            if x.max() > 0 and strength > 1e-5 * h.max():
                problems.append((fortran, y, gram, h, strength / len(y)))
                ours.append(x)

    def lasso(a, y, gram, h, alpha):
        model = Lasso(alpha, positive=True, fit_intercept=False, precompute=gram, max_iter=20000)
        return model.fit(a, y).coef_

    def path(a, y, gram, h, alpha):
        return lars_path(a, y, Gram=gram, Xy=h, alpha_min=alpha, method="lasso", positive=True,
                         return_path=False)[2]

    def path_gram(a, y, gram, h, alpha):
        return lars_path_gram(h, gram, n_samples=len(y), alpha_min=alpha, method="lasso",
                              positive=True, return_path=False)[2]

    def objective(a, y, gram, h, alpha, x):
        return 0.5 * np.sum((y - a @ x) ** 2) + alpha * len(y) * np.abs(x).sum()

    results = {}
    for name, solve in [("lasso", lasso), ("lars_path", path), ("lars_path_gram", path_gram)]:
        seconds, theirs = fastest(solve, problems)
        ratios = [
            objective(*problem, x) / objective(*problem, np.maximum(peer, 0))
            for problem, x, peer in zip(problems, ours, theirs)
        ]
        results[name] = {"seconds": seconds, "objective": max(ratios)}
    print(f"{len(problems)} right-hand sides", file=sys.stderr)
    return results


def main():
    problem, path, *sizes = sys.argv[1:]
    warnings.simplefilter("ignore")  # a peer that stops early shows in the objective
    windows = list(read(path, *map(int, sizes)))
    print(json.dumps({"nnls": nnls, "bpdn": bpdn}[problem](windows)))


if __name__ == "__main__":
    main()
