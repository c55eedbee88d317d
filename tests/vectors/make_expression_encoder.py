"""Writes expression_encoder.npz: the expression encoder of DPE, from its published equations, in PyTorch, in double.

Weights and images are drawn by the generator of make_avatar_net.py from names, so that none need storing: a narrow
encoder of 32 x 32 images, with the gradient that reaches the images, and one of DPE's own sizes. With a file's name,
the latter's weights are also written there as DPE's trainer saves its own: python3 make_expression_encoder.py [weights.pt]
"""
import argparse
import sys

import numpy as np
import torch
import torch.nn.functional as F

STRIDE, SEED = 13, 5
MASK = (1 << 64) - 1


def mix(z):
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def uniform(name, shape, bound):
    state = 0xCBF29CE484222325
    for byte in name.encode():
        state = ((state ^ byte) * 0x100000001B3) & MASK
    gamma = 0x9E3779B97F4A7C15
    with np.errstate(over="ignore"):
        state ^= int(mix(np.uint64((SEED + gamma) & MASK)))
        count = int(np.prod(shape))
        bits = mix(np.uint64(state) + np.uint64(gamma) * np.arange(1, count + 1, dtype=np.uint64))
    values = ((2 * ((bits >> np.uint64(11)).astype(np.float64) * 2.0**-53) - 1) * bound).astype(np.float32)
    return torch.tensor(values.astype(np.float64).reshape(shape))


class Encoder:
    def __init__(self, channels, features, motions, depth, codes):
        self.channels, self.features, self.motions, self.depth, self.codes = channels, features, motions, depth, codes
        self.parameters = {}

    def parameter(self, name, shape, bound):
        self.parameters[name] = uniform(name, shape, bound)
        return self.parameters[name]

    def weight(self, name, *shape):
        return self.parameter(name + ".weight", shape, 3**0.5)  # of unit variance

    def bias(self, name, size):
        return self.parameter(name + ".bias", (size,), 0.1)

    def equalised_conv(self, x, name, outputs, kernel, **options):
        w = self.weight(name, outputs, x.shape[1], kernel, kernel)
        return F.conv2d(x, w / (x.shape[1] * kernel**2) ** 0.5, **options)

    def activate(self, x, name):
        return F.leaky_relu(x + self.bias(name, x.shape[1])[None, :, None, None], 0.2) * 2**0.5

    def blur(self, x, padding):
        taps = torch.tensor([1.0, 3.0, 3.0, 1.0], dtype=torch.float64)
        kernel = torch.outer(taps, taps) / taps.sum() ** 2
        return F.conv2d(F.pad(x, [padding] * 4), kernel.expand(x.shape[1], 1, 4, 4), groups=x.shape[1])

    def linear(self, x, name, outputs):
        w = self.weight(name, outputs, x.shape[1])
        return x @ (w / x.shape[1] ** 0.5).T + self.bias(name, outputs)

    def __call__(self, x):
        prefix = "enc.net_app.convs."
        x = self.activate(self.equalised_conv(x, prefix + "0.0", self.channels[0], 1), prefix + "0.1")
        for i, outputs in enumerate(self.channels[1:], 1):
            block, inputs = f"{prefix}{i}.", x.shape[1]
            y = self.activate(self.equalised_conv(x, block + "conv1.0", inputs, 3, padding=1), block + "conv1.1")
            y = self.equalised_conv(self.blur(y, 2), block + "conv2.1", outputs, 3, stride=2)
            y = self.activate(y, block + "conv2.2")
            skip = self.equalised_conv(self.blur(x, 1), block + "skip.1", outputs, 1, stride=2)
            x = (y + skip) / 2**0.5
        x = self.equalised_conv(x, f"{prefix}{len(self.channels)}", self.features, 4)[:, :, 0, 0]
        for i in range(self.depth):
            x = self.linear(x, f"mlp.{i}", self.motions if i + 1 == self.depth else self.features)
        q, _ = torch.linalg.qr(self.weight("dir", self.features, self.motions))
        x = x @ q.T
        for i in range(3):
            x = self.linear(x, f"mlp_exp.{i}", self.codes)
        return x


stored = {}
small = Encoder([8, 16, 24, 32], 20, 5, 3, 12)
images = uniform("images", (2, 32, 32, 3), 1).requires_grad_()
code = small(images.permute(0, 3, 1, 2))
(code * uniform("code", tuple(code.shape), 1)).sum().backward()
stored["small_code"] = code.detach().numpy()
stored["small_image_gradient"] = images.grad.reshape(-1)[::STRIDE].numpy().copy()
full = Encoder([64, 128, 256, 512, 512, 512, 512], 512, 20, 5, 512)
with torch.no_grad():
    stored["full_code"] = full(uniform("full_image", (1, 256, 256, 3), 1).permute(0, 3, 1, 2)).numpy()
stored["full_parameter_count"] = np.array([sum(p.numel() for p in full.parameters.values())])
np.savez_compressed("expression_encoder.npz", **stored)
if len(sys.argv) > 1:
    network = {name: value.float() for name, value in full.parameters.items()}
    for name in network:
        if "convs" in name and name.endswith(".bias"):
            network[name] = network[name].reshape(1, -1, 1, 1)
    torch.save({"gen": network, "args": argparse.Namespace(size=256)}, sys.argv[1])
