"""Writes evaluation/: a stored prediction set as `degas eval` leaves it (truth/, render/, boxes.json), a small ONNX network
of pictures, and expected.json: what PyTorch and scipy measure of them, in double, by the protocol written anew here.
Run: python3 make_evaluation.py WEIGHTS, the folder of lpips_alex_v0.1.npz and lpips_squeeze_v0.1.npz.
"""
import json
import os
import sys

import numpy as np
import torch
import torch.nn.functional as F
from PIL import Image
from scipy import linalg

HEIGHT, WIDTH, COUNT = 112, 96, 12
REGIONS = ["", "person_", "face_", "mouth_"]
random = np.random.default_rng(11)
torch.manual_seed(12)


# The set: a textured figure over white, and what an avatar might make of it.

def smooth_noise(sigma):
    field = torch.tensor(random.normal(size=(3, 1, HEIGHT, WIDTH)))
    grid = torch.arange(-3 * sigma, 3 * sigma + 1, dtype=torch.float64)
    window = torch.exp(-grid**2 / (2 * sigma**2))
    field = F.conv2d(field, torch.outer(window, window)[None, None], padding=3 * sigma)[:, 0]
    return (field / field.std()).permute(1, 2, 0).numpy()


def picture(shift):
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    body = ((x - 48 - shift) / 21) ** 2 + ((y - 72) / 34) ** 2 < 1
    head = ((x - 48 - shift) / 11) ** 2 + ((y - 24) / 14) ** 2 < 1
    colour = np.where(head[..., None], [0.8, 0.6, 0.5], [0.3, 0.4, 0.6]) + 0.12 * smooth_noise(2)
    return np.where((body | head)[..., None], colour, 1.0), body | head


def save(folder, name, values):
    os.makedirs(f"evaluation/{folder}", exist_ok=True)
    pixels = np.clip(values * 255 + 0.5, 0, 255).astype(np.uint8)
    Image.fromarray(pixels).save(f"evaluation/{folder}/{name}.png", optimize=True)
    return pixels.astype(np.float64) / 255


truths, renders, boxes = [], [], []
for i in range(COUNT):
    shift = 5 * i - 28  # the first one's face lies partly outside of the picture's left border
    truth, mask = picture(shift)
    render = truth + mask[..., None] * (0.02 + 0.01 * i) * smooth_noise(1)
    name = f"cam{i % 2:02}_{i:06}"
    truths.append(save("truth", name, truth))
    renders.append(save("render", name, render))
    rows, columns = np.where(mask)
    person = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
    face = [36 + shift - 10, 8, 44, 34]
    mouth = [42 + shift, 27, 13, 12] if i != 3 else [42 + shift, 27, 10, 12]  # too narrow for SSIM's window
    boxes.append({"camera": f"cam{i % 2:02}", "frame": i, "refined": False, "person": [int(v) for v in person],
                  "face": None if i == 5 else face, "mouth": mouth})
with open("evaluation/boxes.json", "w") as file:
    file.write("[\n" + ",\n".join(json.dumps(box) for box in boxes) + "\n]\n")


class Features(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.first = torch.nn.Conv2d(3, 6, 5, stride=3)
        self.second = torch.nn.Conv2d(6, 7, 3, stride=2)

    def forward(self, pictures):
        return torch.relu(self.second(torch.relu(self.first(pictures)))).mean((2, 3))


network = Features()
torch.onnx.export(network, torch.zeros(1, 3, 40, 40), "evaluation/features.onnx", input_names=["picture"],
                  output_names=["features"], opset_version=11)
network = network.double()


# The protocol.

def psnr(a, b):
    return -10 * np.log10(((a - b) ** 2).mean())


def ssim(a, b):
    grid = torch.arange(11, dtype=torch.float64) - 5
    window = torch.exp(-grid**2 / (2 * 1.5**2))
    kernel = torch.outer(window, window)[None, None] / window.sum() ** 2
    blur = lambda v: F.conv2d(torch.tensor(v).permute(2, 0, 1)[:, None], kernel)
    ma, mb = blur(a), blur(b)
    va, vb, cov = blur(a * a) - ma**2, blur(b * b) - mb**2, blur(a * b) - ma * mb
    c1, c2 = 0.01**2, 0.03**2
    return ((2 * ma * mb + c1) * (2 * cov + c2) / ((ma**2 + mb**2 + c1) * (va + vb + c2))).mean().item()


def axis(size, new):
    """Averages areas where it shrinks, interpolates between pixel centres where it grows."""
    matrix = np.zeros((new, size))
    for o in range(new):
        if new < size:
            for i in range(size):
                matrix[o, i] = max(0, min((o + 1) * size / new, i + 1) - max(o * size / new, i)) * new / size
        else:
            place = np.clip((o + 0.5) * size / new - 0.5, 0, size - 1)
            i = min(int(place), max(size - 2, 0))
            matrix[o, i] += 1 - (place - i)
            matrix[o, min(i + 1, size - 1)] += place - i
    return matrix


def square(image, box, side):
    left, top, width, height = box
    padded = np.pad(image, ((200, 200), (200, 200), (0, 0)), constant_values=1.0)
    cut = padded[top + 200:top + height + 200, left + 200:left + width + 200]
    rows = np.einsum("oi,ijc->ojc", axis(height, side), cut, optimize=True)
    return np.einsum("pj,ojc->opc", axis(width, side), rows, optimize=True)


def grown(box, margin):
    left, top, width, height = box
    side = max(width, height) + 2 * margin
    return [left + width // 2 - side // 2, top + height // 2 - side // 2, side, side]


def cut(image, box):
    left, top, width, height = box
    return image[max(top, 0):max(top + height, 0), max(left, 0):max(left + width, 0)]


def region(index, line):
    """Box of PSNR and SSIM, square of networks and its side; None where there is nothing to measure."""
    if index == 0:
        return [0, 0, WIDTH, HEIGHT], grown(line["person"], 50), 512
    box = line[REGIONS[index][:-1]]
    if box is None or min(cut(truths[0], box).shape[:2]) < 11:
        return None
    return box, grown(box, 0), 256


def lpips_features(name, weights, x):
    conv = lambda key, v, stride=1, padding=0: F.relu(
        F.conv2d(v, weights[key + ".weight"], weights[key + ".bias"], stride=stride, padding=padding))
    pool = lambda v, ceil: F.max_pool2d(v, 3, 2, ceil_mode=ceil)
    fire = lambda i, v: (lambda s: torch.cat([conv(f"features.{i}.expand1x1", s),
                                              conv(f"features.{i}.expand3x3", s, padding=1)], 1))(
        conv(f"features.{i}.squeeze", v))
    out = []
    if name == "alex":
        x = conv("features.0", x, 4, 2); out.append(x)
        x = conv("features.3", pool(x, False), 1, 2); out.append(x)
        x = conv("features.6", pool(x, False), 1, 1); out.append(x)
        x = conv("features.8", x, 1, 1); out.append(x)
        x = conv("features.10", x, 1, 1); out.append(x)
        return out
    x = conv("features.0", x, 2); out.append(x)
    x = fire(4, fire(3, pool(x, True))); out.append(x)
    x = fire(7, fire(6, pool(x, True))); out.append(x)
    x = fire(9, pool(x, True)); out.append(x)
    for i in (10, 11, 12):
        x = fire(i, x); out.append(x)
    return out


def lpips(name, weights, a, b):
    shift = torch.tensor([-.030, -.088, -.188], dtype=torch.float64)[:, None, None]
    scale = torch.tensor([.458, .448, .450], dtype=torch.float64)[:, None, None]
    prepare = lambda v: ((2 * torch.tensor(v).permute(2, 0, 1) - 1 - shift) / scale)[None]
    unit = lambda f: f / (f.pow(2).sum(1, keepdim=True).sqrt() + 1e-10)
    features = [lpips_features(name, weights, prepare(v)) for v in (a, b)]
    return sum((weights[f"lin{i}"][None, :, None, None] * (unit(x) - unit(y)) ** 2).sum(1).mean().item()
               for i, (x, y) in enumerate(zip(*features)))


def network_features(picture, side):
    x = torch.tensor(picture * 255).permute(2, 0, 1)[None]
    x = F.interpolate(x, (side, side), mode="bilinear", align_corners=False)
    return network((x - 100) * 0.02)[0].detach().numpy()


def frechet(a, b):
    ca, cb = np.cov(a, rowvar=False), np.cov(b, rowvar=False)
    return ((a.mean(0) - b.mean(0)) ** 2).sum() + np.trace(ca + cb - 2 * linalg.sqrtm(ca @ cb).real)


expected = {}
weights = {}
for name in ("alex", "squeeze"):
    file = np.load(f"{sys.argv[1]}/lpips_{name}_v0.1.npz")
    weights[name] = {key: torch.tensor(value).double() for key, value in file.items()}
for index, prefix in enumerate(REGIONS):
    figures, truth_features, render_features = [], [], []
    for truth, render, line in zip(truths, renders, boxes):
        seen = region(index, line)
        if seen is None:
            continue
        box, around, side = seen
        a, b = square(truth, around, side), square(render, around, side)
        figures.append([psnr(cut(truth, box), cut(render, box)), ssim(cut(truth, box), cut(render, box)),
                        lpips("alex", weights["alex"], a, b), lpips("squeeze", weights["squeeze"], a, b)])
        truth_features.append(network_features(a, 40))
        render_features.append(network_features(b, 40))
    for key, value in zip(["psnr", "ssim", "lpips", "lpips_squeeze"], np.mean(figures, 0)):
        expected[prefix + key] = value
    expected[prefix + "fid"] = frechet(np.array(truth_features), np.array(render_features))
distances = []
for truth, render, line in zip(truths, renders, boxes):
    if line["face"] is None:
        continue
    faces = [square(v, grown(line["face"], 0), 40) for v in (truth, render)]
    codes = [network_features(np.floor(face * 255 + 0.5) / 255, 40) for face in faces]  # 8-bit pictures
    distances.append(1 - codes[0] @ codes[1] / np.sqrt((codes[0] @ codes[0]) * (codes[1] @ codes[1])))
expected["aed"] = np.mean(distances)
with open("evaluation/expected.json", "w") as file:
    json.dump(expected, file, indent=1)
print(json.dumps(expected, indent=1))
