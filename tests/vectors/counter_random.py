"""Uniform numbers in double from a seed and a name, as model/net/parameter_store.cpp draws them: what both sides of a test can
make need not be stored."""
import numpy as np
import torch

MASK = (1 << 64) - 1


def mix(z):
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def uniform(name, shape, bound, seed):
    state = 0xCBF29CE484222325
    for byte in name.encode():
        state = ((state ^ byte) * 0x100000001B3) & MASK
    gamma = 0x9E3779B97F4A7C15
    with np.errstate(over="ignore"):
        state ^= int(mix(np.uint64((seed + gamma) & MASK)))
        count = int(np.prod(shape))
        bits = mix(np.uint64(state) + np.uint64(gamma) * np.arange(1, count + 1, dtype=np.uint64))
    values = ((2 * ((bits >> np.uint64(11)).astype(np.float64) * 2.0**-53) - 1) * bound).astype(np.float32)
    return torch.tensor(values.astype(np.float64).reshape(shape))
