"""Writes avatar_net.npz: the network of method.md in PyTorch, in double, at R = 128 and width 0.25.

Weights, biases and inputs are drawn by counter_random.py, from names, so that none need storing. Maps and gradients are
stored at every STRIDE-th element. Run: python3 make_avatar_net.py
"""
import numpy as np
import torch
import torch.nn.functional as F

from counter_random import uniform

R, SEED, TEST_SEED, STRIDE, CODE, JOINTS = 128, 3, 7, 97, 20, 54
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


def up(x, name, cin, cout, groups=1):
    x = F.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)
    return res(x, name, cin, cout, groups=groups)


def code_decoder(code, name, size, first, channels):
    """The device's layout of side 4 is (4, 4, C)."""
    x = linear(code, name + ".linear", size, 16 * first, True).reshape(1, 4, 4, first).permute(0, 3, 1, 2)
    for i, c in enumerate(channels):
        x = up(x, f"{name}.{i}", first, c)
        first = c
    return x


def store(name, nhwc):
    stored[name] = nhwc.detach().reshape(-1)[::STRIDE].numpy().copy()


def inject(x, face):
    x = x.clone()
    x[:, :, : face.shape[2], : face.shape[3]] = face[:, : x.shape[1]]
    return x


vertex_map = uniform("posed_vertex_map", (1, R, R, 3), 1, TEST_SEED).permute(0, 3, 1, 2)
pose = uniform("pose", (3 * JOINTS,), 1, TEST_SEED)
code = uniform("face_code", (CODE,), 1, TEST_SEED)
masks = (uniform("joint_masks", (R // 8, R // 8, JOINTS), 1, TEST_SEED) > 0).double()
masks = masks[:, :, torch.arange(3 * JOINTS) // 3].permute(2, 0, 1)[None]

face = code_decoder(code[None], "face", CODE, 8, [8])
pose_map = inject(res(pose[None, :, None, None] * masks, "pose", 3 * JOINTS, 8, kernel=1), face)
x, c = vertex_map, 3
for i, n in enumerate([8, 8, 8]):
    x, c = res(x, f"pvm.{i}", c, n, stride=2), n
pvm_map = inject(x, face)
x, c = vertex_map, 3
for i, n in enumerate([8, 8, 8, 8, 32]):
    x, c = res(x, f"pve.{i}", c, n, stride=2), n
flat = x.permute(0, 2, 3, 1).reshape(1, -1)
latent = linear(flat, "pve.mean", 512, 256, False)
deviation = 0.1 * linear(flat, "pve.log_deviation", 512, 256, False)
store("latent", latent)
store("log_deviation", deviation)
pve_map = inject(code_decoder(latent, "pve_decoder", 256, 32, [16, 8]), face)

joint = res(torch.cat([pose_map, pvm_map, pve_map], 1), "joint", 24, 32)
store("joint_feature", joint.permute(0, 2, 3, 1))
x, c = joint.repeat(1, 3, 1, 1), 32
for i, n in enumerate([16, 8, 8]):
    x, c = up(x, f"decoder.{i}", 3 * c, 3 * n, groups=3), n
    store(f"level_{i}", x.permute(0, 2, 3, 1))
loss = (0.5 * (latent**2 + torch.exp(2 * deviation) - 1) - deviation).mean()
stored["divergence"] = loss.detach().reshape(1).numpy()
for name, channels, part in zip(["position", "rotation_scale", "color_opacity"], [3, 7, 4], x.split(8, 1)):
    head = conv(part, "head." + name, 8, channels, activation=False).permute(0, 2, 3, 1)
    store(name, head)
    loss = loss + (head * uniform(name, tuple(head.shape), 1, TEST_SEED)).sum()
stored["loss"] = loss.detach().reshape(1).numpy()
loss.backward()
for name, value in parameters.items():
    stored["gradient " + name] = value.grad.reshape(-1)[::STRIDE].numpy()[:64].copy()
stored["parameter_count"] = np.array([sum(p.numel() for p in parameters.values())], dtype=np.float64)
np.savez_compressed("avatar_net.npz", **stored)
