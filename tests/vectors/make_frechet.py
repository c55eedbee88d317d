"""Writes frechet.npz: sets of features and their Frechet distances, by scipy's matrix square root of the product of the
covariances where these have full rank, by the eigenvalues of the product where they have not (its square root is then
ill-conditioned). Run: python3 make_frechet.py
"""
import numpy as np
from scipy import linalg

random = np.random.default_rng(3)


def features(count, size, shift):
    mixing = random.normal(size=(size, size)) / np.sqrt(size)
    return (random.normal(size=(count, size)) @ mixing + shift * random.normal(size=size)).astype(np.float32)


def distance(a, b):
    a, b = a.astype(np.float64), b.astype(np.float64)
    ca, cb = np.cov(a, rowvar=False), np.cov(b, rowvar=False)
    if min(len(a), len(b)) > a.shape[1]:
        trace = np.trace(linalg.sqrtm(ca @ cb)).real
    else:
        trace = np.sqrt(np.maximum(linalg.eigvals(ca @ cb).real, 0)).sum()
    return ((a.mean(0) - b.mean(0)) ** 2).sum() + np.trace(ca) + np.trace(cb) - 2 * trace


arrays = {}
for name, counts, size, shift in [("full", (90, 70), 24, 0.3), ("few", (8, 11), 40, 0.2), ("mixed", (60, 7), 20, 0.1),
                                  ("near", (50, 50), 12, 0)]:
    a, b = features(counts[0], size, shift), features(counts[1], size, shift)
    if name == "near":
        b = a + 1e-3 * b
    arrays.update({name + "_a": a, name + "_b": b, name: np.array([distance(a, b)])})
    print(name, distance(a, b))
np.savez_compressed("frechet.npz", **arrays)
