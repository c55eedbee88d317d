"""Writes skip_net.npz and texel_mlp.npz: the networks of net.kind skips and mlp (model/net/skip_net.h, texel_mlp.h) at R = 128
and width 0.25. Run: python3 make_baseline_nets.py
"""
import torch

from counter_random import uniform
from network_layers import SEED, TEST_SEED, conv, linear, parameter, res, save, store_heads, up

R, JOINTS = 128, 54

maps = [uniform("posed_vertex_map", (1, R, R, 3), 1, TEST_SEED).permute(0, 3, 1, 2)]
for i, channels in enumerate([8, 8, 8, 8, 32]):
    maps.append(res(maps[-1], f"encoder.{i}", maps[-1].shape[1], channels, stride=2))
x = up(maps[5], "up.0", 16, skip=maps[4])
x = up(x, "up.1", 8, skip=maps[3])
x = res(x, "joint", 8, 32).repeat(1, 3, 1, 1)
x = up(x, "decoder.0", 48, groups=3, skip=maps[2])
x = up(x, "decoder.1", 24, groups=3, skip=maps[1])
x = up(x, "decoder.2", 24, groups=3)
save("skip_net.npz", store_heads(x.split(8, 1)))

pose = uniform("pose", (3 * JOINTS,), 1, TEST_SEED)[None]
embedding = linear(linear(pose, "pose.0", 3 * JOINTS, 32, True), "pose.1", 32, 8, False)
features = parameter("features", uniform("features", (1, R, R, 8), 1, SEED)).permute(0, 3, 1, 2)
x = torch.cat([features, embedding[:, :, None, None].expand(1, 8, R, R)], 1)
for i in range(3):
    x = conv(x, f"hidden.{i}", x.shape[1], 32, kernel=1, tied=True)
save("texel_mlp.npz", store_heads([x, x, x], kernel=1))
