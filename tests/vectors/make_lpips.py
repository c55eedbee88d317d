"""Writes lpips.npz: a tiny network of every layer kind of LPIPS, two images, their distance and its gradient (torch, double)."""
import os
import numpy as np
import torch
import torch.nn.functional as F

torch.manual_seed(2)
make = lambda *shape: (torch.randn(*shape) * 0.5).double()
parts = {"first": (7, 3, 3, 3), "squeeze": (4, 7, 1, 1), "narrow": (5, 4, 1, 1), "wide": (6, 4, 3, 3)}
net = {name: (make(*shape), make(shape[0]) * 0.25) for name, shape in parts.items()}
linear = [torch.rand(7).double(), torch.rand(11).double()]
image = torch.rand(14, 17, 3).double().requires_grad_()
target = torch.rand(14, 17, 3).double()


def features(rgb):
    shift = torch.tensor([-.030, -.088, -.188], dtype=torch.float64)[:, None, None]
    scale = torch.tensor([.458, .448, .450], dtype=torch.float64)[:, None, None]
    x = ((2 * rgb.permute(2, 0, 1) - 1 - shift) / scale)[None]
    first = F.relu(F.conv2d(x, *net["first"], stride=2, padding=2))
    x = F.max_pool2d(first, 3, 2, ceil_mode=True)
    x = F.relu(F.conv2d(x, *net["squeeze"]))
    return [first, torch.cat([F.relu(F.conv2d(x, *net["narrow"])), F.relu(F.conv2d(x, *net["wide"], padding=1))], 1)]


unit = lambda f: f / (f.pow(2).sum(1, keepdim=True).sqrt() + 1e-10)
distance = sum((w[None, :, None, None] * (unit(a) - unit(b)) ** 2).sum(1).mean()
               for a, b, w in zip(features(image), features(target), linear))
distance.backward()
arrays = {"image": image.detach(), "target": target, "gradient": image.grad, "lin0": linear[0], "lin1": linear[1]}
for name, (weight, bias) in net.items():
    arrays[name + ".weight"], arrays[name + ".bias"] = weight, bias
arrays = {key: value.numpy() for key, value in arrays.items()}
arrays["distance"] = np.array([distance.item()])
np.savez_compressed(os.path.join(os.path.dirname(__file__), "lpips.npz"), **arrays)
