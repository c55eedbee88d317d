#!/usr/bin/env python3
"""Writes numpy.npz: the array kinds that NpzFile must read, and one that it must refuse."""
import pathlib

import numpy as np

counted = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
np.savez_compressed(
    pathlib.Path(__file__).with_name("numpy.npz"),
    c_order=counted,
    fortran=np.asfortranarray(counted.astype(np.float64)),
    big_endian=np.array([1, -2, 300], dtype=">i4"),
    text=np.array("naïve"),
    flag=np.array(True),
    objects=np.array([{"never": "unpickled"}, None], dtype=object),
)
