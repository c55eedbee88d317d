"""The layers of method.md's networks in PyTorch, in double, as make_avatar_net.py and make_baseline_nets.py put them together.

Weights, biases and inputs are drawn by counter_random.py, from names, so that none need storing. Maps and gradients are
stored at every STRIDE-th element.
"""
import numpy as np
import torch
import torch.nn.functional as F

from counter_random import uniform

SEED, TEST_SEED, STRIDE = 3, 7, 97
stored, parameters = {}, {}


def parameter(name, value):
    parameters[name] = value.requires_grad_()
    return value


def weight(name, shape, fan_in, groups=1):
    """w = g v / ||v||; as a matrix of the given shape, outputs last."""
    v = parameter(name + ".v", uniform(name + ".v", shape, 1 / np.sqrt(fan_in), SEED))
    outputs = shape[-1] * groups
    g = v.detach().norm().to(torch.float32).to(torch.float64) * torch.ones(outputs, dtype=torch.float64)
    g = parameter(name + ".gain", g * (1 + 0.1 * uniform(name + ".gain", (outputs,), 1, TEST_SEED)).to(torch.float64))
    return v, g


def bias(name, shape):
    return parameter(name + ".bias", uniform(name + ".bias", shape, 0.1, TEST_SEED))


def conv(x, name, cin, cout, kernel=3, stride=1, groups=1, tied=False, activation=True):
    """x: (1, C, H, W)."""
    v, g = weight(name, (groups, kernel, kernel, cin // groups, cout // groups), cin // groups * kernel**2, groups)
    w = (v / v.norm()).permute(0, 4, 3, 1, 2).reshape(cout, cin // groups, kernel, kernel) * g[:, None, None, None]
    y = F.conv2d(x, w, stride=stride, padding=kernel // 2, groups=groups)
    if tied:
        y = y + bias(name, (cout,))[None, :, None, None]
    else:
        y = y + bias(name, (y.shape[2], y.shape[3], cout)).permute(2, 0, 1)[None]
    return F.leaky_relu(y, 0.2) if activation else y


def linear(x, name, inputs, outputs, activation):
    v, g = weight(name, (inputs, outputs), inputs)
    y = x @ (v / v.norm() * g) + bias(name, (outputs,))
    return F.leaky_relu(y, 0.2) if activation else y


def res(x, name, cin, cout, kernel=3, stride=1, groups=1):
    y = conv(x, name + ".first", cin, cin, kernel, 1, groups)
    y = conv(y, name + ".second", cin, cout, kernel, stride, groups)
    return y + conv(x, name + ".skip", cin, cout, 1, stride, groups, tied=True, activation=False)


def up(x, name, cout, groups=1, skip=None):
    """skip: a map that stands beside the enlarged one, in each group."""
    x = F.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)
    if skip is not None:
        x = torch.cat([part for group in x.chunk(groups, 1) for part in (group, skip)], 1)
    return res(x, name, x.shape[1], cout, groups=groups)


def code_decoder(code, name, size, first, channels):
    """The device's layout of side 4 is (4, 4, C)."""
    x = linear(code, name + ".linear", size, 16 * first, True).reshape(1, 4, 4, first).permute(0, 3, 1, 2)
    for i, c in enumerate(channels):
        x = up(x, f"{name}.{i}", c)
    return x


def store(name, nhwc):
    stored[name] = nhwc.detach().reshape(-1)[::STRIDE].numpy().copy()


def store_heads(groups, kernel=3):
    """Stores the heads of a group of channels each; the sum of their products with numbers drawn."""
    loss = 0
    for name, channels, part in zip(["position", "rotation_scale", "color_opacity"], [3, 7, 4], groups):
        head = conv(part, "head." + name, part.shape[1], channels, kernel, activation=False).permute(0, 2, 3, 1)
        store(name, head)
        loss = loss + (head * uniform(name, tuple(head.shape), 1, TEST_SEED)).sum()
    return loss


def save(file, loss):
    """What was stored and the loss' gradients; the next network starts anew."""
    stored["loss"] = loss.detach().reshape(1).numpy()
    loss.backward()
    for name, value in parameters.items():
        stored["gradient " + name] = value.grad.reshape(-1)[::STRIDE].numpy()[:64].copy()
    stored["parameter_count"] = np.array([sum(p.numel() for p in parameters.values())], dtype=np.float64)
    np.savez_compressed(file, **stored)
    stored.clear()
    parameters.clear()
