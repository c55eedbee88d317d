"""Writes conv2d.npz: PyTorch's convolutions and their gradients, in double precision, for tests/host/ops/conv2d_test.cpp."""
import pathlib

import numpy as np
import torch
import torch.nn.functional as functional

# name: batch, height, width, channels, output channels, kernel, stride, padding, groups, slope, bias
CASES = {
    "grouped": (1, 7, 6, 12, 54, 3, 1, 1, 3, 0.2, "untied"),
    "down": (2, 8, 10, 8, 17, 3, 2, 1, 1, 0.2, "tied"),
    "k4s2": (1, 8, 6, 5, 20, 4, 2, 1, 1, 0.2, "none"),
    "alex": (1, 27, 23, 3, 7, 11, 4, 2, 1, 0.0, "tied"),
    "five": (1, 6, 5, 4, 33, 5, 1, 2, 1, 1.0, "tied"),
    "skip": (2, 3, 4, 30, 18, 1, 1, 0, 3, 1.0, "untied"),
    "wide": (1, 14, 15, 32, 32, 3, 1, 1, 1, 0.2, "tied"),
}

# As a network's are, so that sums of many terms are of the size of one: a sixteenth is exact in float32.
SMALL_WEIGHTS = {"wide"}


def draw(*shape):
    """Numbers that float32 holds exactly, so that the stored inputs are the ones PyTorch used."""
    return torch.randn(*shape, dtype=torch.float32).double().requires_grad_()


def nhwc(tensor):
    return tensor.permute(0, 2, 3, 1).contiguous()


def main():
    torch.manual_seed(7)
    arrays = {}
    for name, (n, h, w, cin, cout, k, stride, padding, groups, slope, bias_kind) in CASES.items():
        x = draw(n, cin, h, w)
        weight = draw(cout, cin // groups, k, k)
        if name in SMALL_WEIGHTS:
            weight = (weight.detach() / 16).requires_grad_()
        y = functional.conv2d(x, weight, None, stride, padding, 1, groups)
        bias = torch.zeros(0, dtype=torch.float64)
        if bias_kind == "tied":
            bias = draw(cout)
            y = y + bias[None, :, None, None]
        if bias_kind == "untied":
            bias = draw(1, cout, *y.shape[2:])
            y = y + bias
        y = functional.leaky_relu(y, slope)
        factor = draw(*y.shape).detach()
        (y * factor).sum().backward()

        def ours(t):  # (Cout, Cin / groups, K, K) -> (groups, K, K, Cin / groups, Cout / groups)
            return t.reshape(groups, cout // groups, cin // groups, k, k).permute(0, 3, 4, 2, 1).contiguous()

        def ours_bias(t):
            return t if bias_kind != "untied" else nhwc(t)[0].contiguous()

        options = np.array([stride, padding, groups, slope], dtype=np.float64)
        named = {"options": torch.from_numpy(options), "input": nhwc(x), "weight": ours(weight), "output": nhwc(y),
                 "factor": nhwc(factor), "input_gradient": nhwc(x.grad), "weight_gradient": ours(weight.grad)}
        if bias_kind != "none":
            named |= {"bias": ours_bias(bias), "bias_gradient": ours_bias(bias.grad)}
        for key, value in named.items():
            arrays[f"{name}.{key}"] = value.detach().numpy().astype(np.float32)
    np.savez_compressed(pathlib.Path(__file__).with_name("conv2d.npz"), **arrays)


main()
