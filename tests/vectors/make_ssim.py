"""Writes ssim.npz: L1 + SSIM (zero padding) with its gradient, and valid-region SSIM, in double precision by torch."""
import os
import numpy as np
import torch
import torch.nn.functional as F

torch.manual_seed(1)
offsets = torch.arange(11, dtype=torch.float64) - 5
window = torch.exp(-offsets ** 2 / (2 * 1.5 ** 2))
window = window / window.sum()


def ssim_map(x, y, padding):
    """Per-pixel SSIM of (H,W,C) images, from the textbook definition."""
    kernel = torch.outer(window, window)[None, None]
    blur = lambda v: F.conv2d(v.permute(2, 0, 1)[:, None], kernel, padding=padding)
    mx, my = blur(x), blur(y)
    vx, vy, cov = blur(x * x) - mx ** 2, blur(y * y) - my ** 2, blur(x * y) - mx * my
    c1, c2 = 0.01 ** 2, 0.03 ** 2
    return (2 * mx * my + c1) * (2 * cov + c2) / ((mx ** 2 + my ** 2 + c1) * (vx + vy + c2))


def noise(shape):
    x = torch.rand(shape).double()
    return x, (x * 0.7 + 0.3 * torch.rand(shape).double()).float().double()


def figures_before_background(shape, boxes):
    """The two pictures differ in the boxes (top, left, height, width) alone."""
    row, column, channel = np.indices(shape)
    x = torch.tensor((7 * row + 3 * column + 5 * channel) % 16 / 16).double()
    y = x.clone()
    for top, left, height, width in boxes:
        box = np.s_[top:top + height, left:left + width]
        x[box], y[box] = noise((height, width, 3))
    return x, y


pictures = {name: noise(shape) for name, shape in
            {"small": (3, 5, 3), "odd": (23, 37, 3), "wide": (13, 90, 3), "gray": (17, 33, 1)}.items()}
# At borders of the kernels' tiles and strips, in a corner, and far from any.
pictures["figures"] = figures_before_background((41, 180, 3), [(15, 62, 6, 20), (16, 84, 1, 1), (40, 179, 1, 1)])
arrays = {}
for name, (x, y) in pictures.items():
    x.requires_grad_()
    loss = 0.8 * (x - y).abs().mean() + 0.2 * (1 - ssim_map(x, y, 5).mean())
    loss.backward()
    gradient = np.where(x.grad.abs() < 1e-18, 0, x.grad)  # the rest of rounding, far from any difference
    arrays.update({f"{name}_image": x.detach().float().numpy(), f"{name}_target": y.float().numpy(),
                   f"{name}_loss": np.array([loss.item()]), f"{name}_gradient": gradient})
    if min(x.shape[:2]) >= 11:
        arrays[f"{name}_ssim"] = np.array([ssim_map(x, y, 0).mean().item()])
np.savez_compressed(os.path.join(os.path.dirname(__file__), "ssim.npz"), **arrays)
