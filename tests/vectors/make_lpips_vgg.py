"""Prints LPIPS of torchvision's VGG16 layers in PyTorch, in double, with drawn weights and pictures (counter_random.py); the
number stands in tests/model/loss/lpips_weights_test.cpp. Run: python3 make_lpips_vgg.py
"""
import torch
import torch.nn.functional as F

from counter_random import uniform

SEED, HEIGHT, WIDTH = 5, 35, 48
shift = torch.tensor([-.030, -.088, -.188], dtype=torch.float64)[:, None, None]
scale = torch.tensor([.458, .448, .450], dtype=torch.float64)[:, None, None]


def features(x):
    compared, place, inputs = [], 0, 3
    for stage in [[64, 64], [128, 128], [256] * 3, [512] * 3, [512] * 3]:
        if place:
            x = F.max_pool2d(x, 2, 2)
            place += 1
        for outputs in stage:
            name = f"features.{place}"
            weight = uniform(name + ".weight", (outputs, inputs, 3, 3), (6 / (9 * inputs)) ** 0.5, SEED)
            x = F.relu(F.conv2d(x, weight, uniform(name + ".bias", (outputs,), 0.1, SEED), padding=1))
            place, inputs = place + 2, outputs
        compared.append(x)
    return compared


unit = lambda f: f / (f.pow(2).sum(1, keepdim=True).sqrt() + 1e-10)
a, b = (((uniform(name, (HEIGHT, WIDTH, 3), 1, SEED).permute(2, 0, 1) - shift) / scale)[None] for name in ("image", "target"))
total = 0
for i, (x, y) in enumerate(zip(features(a), features(b))):
    weights = 1 + uniform(f"lin{i}", (x.shape[1],), 1, SEED)
    total += (weights[None, :, None, None] * (unit(x) - unit(y)) ** 2).sum(1).mean()
print(f"{total.item():.10f}")
