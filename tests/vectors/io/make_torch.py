#!/usr/bin/env python3
"""Writes torch_*.pt with torch.save: what read_torch_archive must read, and what it must refuse."""
import argparse
import pathlib
from collections import OrderedDict

import torch

here = pathlib.Path(__file__).parent
counted = torch.arange(24, dtype=torch.float32).reshape(2, 3, 4)
torch.save({"exp": counted.reshape(1, 24) / 8}, here / "torch_code.pt")
torch.save(counted.permute(2, 0, 1)[1:, :, ::2], here / "torch_bare.pt")
layer = torch.nn.Linear(2, 3)
with torch.no_grad():
    layer.weight.copy_(torch.arange(6.0).reshape(3, 2))
    layer.bias.fill_(-1)
torch.save(
    {
        "model": layer.state_dict(),
        "nested": OrderedDict(half=torch.tensor([0.5, -2]).half(), long=torch.tensor(7), flag=torch.tensor([True])),
        "epoch": 3,
        "rate": 1e-4,
        "names": ["a", ("b", None)],
        "parameter": torch.nn.Parameter(torch.tensor([2.0, 3.0])),
        "args": argparse.Namespace(size=256, lr=2e-3, resume_ckpt=None, distributed=False),
    },
    here / "torch_state.pt",
)
torch.save({"exp": counted, "device": torch.device("cpu")}, here / "torch_refused.pt")
