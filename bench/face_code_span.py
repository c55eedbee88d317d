#!/usr/bin/env python3
"""How much of the jaw's motion in a novel sequence its face codes tell, to a reader that knows the training sequence.

usage: face_code_span.py CAPTURE_A   (the folder with P1C1 and P1C2; needs numpy)

Ridge regression from each frame's code (the mean of its four most frontal cameras, cam02 left out) to the registered
jaw's opening. Prints the share of P1C2's variance that it explains, fitted on P1C1 alone, and on P1C1 with the other
frames of P1C2; and the share of P1C2's variance of codes outside the span of P1C1's.
"""
import sys

import numpy as np

HELD_OUT, FRONTAL_VIEWS, RIDGE = 2, 4, 30.0


def load(folder):
    """Codes (T, C) and jaw openings (T), radians."""
    bundle = np.load(f"{folder}/expression_codes.npz")
    valid = bundle["valid"].astype(bool)
    valid[:, HELD_OUT] = False
    codes = []
    for code, usable, yaw in zip(bundle["codes"].astype(float), valid, np.abs(bundle["yaw_deg"])):
        frontal = [camera for camera in np.argsort(yaw) if usable[camera]][:FRONTAL_VIEWS]
        codes.append(code[frontal].mean(axis=0))
    return np.array(codes), np.load(f"{folder}/smplx.npz")["jaw_pose"].reshape(len(codes), 3)[:, 0].astype(float)


def predict(codes, jaw, seen):
    centred, mean = codes - codes.mean(axis=0), codes.mean(axis=0)
    weights = np.linalg.solve(centred @ centred.T + RIDGE * np.eye(len(codes)), jaw - jaw.mean())
    return jaw.mean() + (seen - mean) @ centred.T @ weights


def explained(jaw, predicted):
    return 1 - ((predicted - jaw) ** 2).sum() / ((jaw - jaw.mean()) ** 2).sum()


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    codes, jaw = load(f"{sys.argv[1]}/P1C1")
    novel_codes, novel_jaw = load(f"{sys.argv[1]}/P1C2")
    print(f"jaw explained, fitted on P1C1: {explained(novel_jaw, predict(codes, jaw, novel_codes)):.2f}")
    left_out = [
        predict(np.vstack([codes, np.delete(novel_codes, i, axis=0)]), np.append(jaw, np.delete(novel_jaw, i)),
                novel_codes[i:i + 1])[0] for i in range(len(novel_jaw))
    ]
    print(f"fitted on P1C1 and the other frames of P1C2: {explained(novel_jaw, np.array(left_out)):.2f}")
    basis = np.linalg.svd(codes - codes.mean(axis=0), full_matrices=False)[2][:len(codes) - 1]
    seen = novel_codes - codes.mean(axis=0)
    outside = seen - seen @ basis.T @ basis
    print(f"variance of P1C2's codes outside the span of P1C1's: {(outside ** 2).sum() / (seen ** 2).sum():.2f}")


if __name__ == "__main__":
    main()
