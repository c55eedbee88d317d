"""Writes resize.npz: an image shrunk by area and grown linearly, by torch."""
import os
import numpy as np
import torch
import torch.nn.functional as F

torch.manual_seed(4)
image = torch.rand(21, 16, 3).double()
batch = image.permute(2, 0, 1)[None]
back = lambda b: b[0].permute(1, 2, 0).numpy()
shrink = torch.zeros(13, 21, dtype=torch.float64)
for out in range(13):  # exact fractional areas, which torch's adaptive pooling does not have
    for i in range(21):
        shrink[out, i] = max(0, min((out + 1) * 21 / 13, i + 1) - max(out * 21 / 13, i)) * 13 / 21
np.savez_compressed(os.path.join(os.path.dirname(__file__), "resize.npz"), image=image.numpy(), same=image.numpy(),
                    shrunk=back(torch.einsum("oi,ncix->ncox", shrink, batch)),
                    halved=back(F.interpolate(batch, (7, 8), mode="area")),
                    grown=back(F.interpolate(batch, (50, 33), mode="bilinear", align_corners=False)))
