"""Times scipy and scikit-learn on the problems that benches/recover.rs writes, and compares our solutions with theirs.

python recover_peers.py nnls|bpdn PROBLEMS.f64 L S RIGHT_HAND_SIDES

Prints {peer: {"seconds": per right-hand side, "objective": largest ratio of ours to the peer's, "snr"}}, and the SNR of
our solutions under "this".
"""

import json
import sys
import time
import warnings

import numpy as np

RUNS = 3


def read(path, patterns, elements, sides):
    """Yields A [L, S], Y [sides, L], our X [sides, S] and the true X of each window."""
    data = np.fromfile(path, "<f8")
    per_window = patterns * elements + sides * (patterns + 2 * elements)
    for window in data.reshape(-1, per_window):
        a = window[: patterns * elements].reshape(patterns, elements)
        rest = window[patterns * elements :].reshape(sides, patterns + 2 * elements)
        ys, ours, truth = np.split(rest, [patterns, patterns + elements], axis=1)
        yield np.ascontiguousarray(a), ys.copy(), ours.copy(), truth.copy()


def fastest(solve, problems):
    """Returns the seconds per problem of the fastest run, and the last run's solutions."""
    best = np.inf
    for _ in range(RUNS):
        start = time.perf_counter()
        solutions = [solve(*problem) for problem in problems]
        best = min(best, time.perf_counter() - start)
    return best / len(problems), solutions


def snr(solutions, truths):
    solutions, truths = np.array(solutions), np.array(truths)
    return 10 * np.log10(np.sum(truths**2) / np.sum((solutions - truths) ** 2))


def nnls(windows):
    import scipy.optimize

    problems = [(a, y) for a, ys, _, _ in windows for y in ys]
    ours = [x for _, _, xs, _ in windows for x in xs]
    truths = [t for _, _, _, ts in windows for t in ts]
    seconds, theirs = fastest(lambda a, y: scipy.optimize.nnls(a, y)[0], problems)
    ratios = []
    for (a, y), x, peer in zip(problems, ours, theirs):
        # If both meet the measurements exactly, the residuals are rounding errors.
        least = 1e-10 * np.linalg.norm(y)
        here, there = (max(np.linalg.norm(y - a @ z), least) for z in (x, peer))
        ratios.append(here / there)
    return {
        "this": {"snr": snr(ours, truths)},
        "scipy": {"seconds": seconds, "objective": max(ratios), "snr": snr(theirs, truths)},
    }


def bpdn(windows):
    from sklearn.linear_model import Lasso, lars_path, lars_path_gram

    problems, ours, truths = [], [], []
    for a, ys, xs, ts in windows:
        gram = a.T @ a
        fortran = np.asfortranarray(a)
        for y, x, truth in zip(ys, xs, ts):
            h = a.T @ y
            # A black pixel has no λ.
            if x.max() > 0:
                strength = (a.T @ (y - a @ x))[x > 0].mean()
                problems.append((fortran, y, gram, h, strength / len(y)))
                ours.append(x)
                truths.append(truth)

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

    results = {"this": {"snr": snr(ours, truths)}}
    for name, solve in [("lasso", lasso), ("lars_path", path), ("lars_path_gram", path_gram)]:
        seconds, theirs = fastest(solve, problems)
        ratios = [
            objective(*problem, x) / objective(*problem, np.maximum(peer, 0))
            for problem, x, peer in zip(problems, ours, theirs)
        ]
        results[name] = {
            "seconds": seconds, "objective": max(ratios), "snr": snr(theirs, truths)
        }
    return results


def main():
    problem, path, *sizes = sys.argv[1:]
    warnings.simplefilter("ignore")  # the objective shows a peer that stops early
    windows = list(read(path, *map(int, sizes)))
    print(json.dumps({"nnls": nnls, "bpdn": bpdn}[problem](windows)))


if __name__ == "__main__":
    main()
