"""Writes avatar_net.npz: the network of method.md at R = 128 and width 0.25. Run: python3 make_avatar_net.py"""
import torch

from counter_random import uniform
from network_layers import TEST_SEED, code_decoder, linear, res, save, store, store_heads, stored, up

R, CODE, JOINTS = 128, 20, 54


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
x = joint.repeat(1, 3, 1, 1)
for i, n in enumerate([16, 8, 8]):
    x = up(x, f"decoder.{i}", 3 * n, groups=3)
    store(f"level_{i}", x.permute(0, 2, 3, 1))
divergence = (0.5 * (latent**2 + torch.exp(2 * deviation) - 1) - deviation).mean()
stored["divergence"] = divergence.detach().reshape(1).numpy()
save("avatar_net.npz", divergence + store_heads(x.split(8, 1)))
