"""Writes optimiser.npz: the paths of torch.optim.Adam on two parameters with given gradients, in double precision, and that of
Rprop on a third by numpy (torch.optim.Rprop takes no step where a sign turns, which is another form of it).

Clipping is applied to the gradients beforehand by the method's rule (a norm above 1 is scaled to 0.1). The second
parameter has no gradient in step 2; step 5 has a NaN gradient and is left out, as the optimiser must leave it out.
"""
import os
import numpy as np
import torch

torch.manual_seed(3)
steps, skipped, absent = 9, 5, 2
rates = np.linspace(1e-2, 2e-3, steps)
values = [torch.randn(1031).double(), torch.randn(7, 3).double()]
parameters = [torch.nn.Parameter(v.clone()) for v in values]
optimizer = torch.optim.Adam([{"params": [parameters[0]]}, {"params": [parameters[1]]}], eps=1e-15, betas=(0.9, 0.99))
arrays = {"a": values[0].numpy(), "b": values[1].numpy(), "rates": rates}
for step in range(steps):
    gradients = [torch.randn_like(v) * (0.04 if step % 2 else 0.002) for v in values]
    gradients = [g.float().double() for g in gradients]
    arrays[f"gradient_a{step}"] = gradients[0].float().numpy()
    arrays[f"gradient_b{step}"] = gradients[1].float().numpy()
    if step == skipped:
        arrays[f"gradient_a{step}"][17] = np.nan
        continue
    if step == absent:
        gradients[1] = None
    norm = sum((g ** 2).sum() for g in gradients if g is not None).sqrt()
    arrays[f"norm{step}"] = np.array([norm.item()])
    for p, g in zip(parameters, gradients):
        p.grad = None if g is None else g * (0.1 / norm if norm > 1 else 1)
    optimizer.param_groups[0]["lr"] = rates[step]
    optimizer.param_groups[1]["lr"] = 0.5 * rates[step]
    optimizer.step()
arrays["a_end"] = parameters[0].detach().numpy()
arrays["b_end"] = parameters[1].detach().numpy()
arrays["a_moment"] = optimizer.state[parameters[0]]["exp_avg"].numpy()
arrays["b_moment2"] = optimizer.state[parameters[1]]["exp_avg_sq"].numpy()

rate = 1e-3
value = torch.randn(1031).double().numpy()
arrays["c"] = value.copy()
steps, last = np.ones(1031), np.zeros(1031)
for step in range(12):
    # Of signs that tend to stay, so that steps reach both bounds; some are zero.
    gradient = torch.randn(1031).numpy() + np.linspace(-3, 3, 1031) * (-1.0) ** (step * (np.arange(1031) % 2))
    gradient[step::31] = 0
    arrays[f"gradient_c{step}"] = gradient = gradient.astype(np.float32)
    turn = np.sign(gradient) * np.sign(last)
    steps = np.clip(steps * np.where(turn > 0, 1.5, np.where(turn < 0, 0.6, 1)), 0.05, 10)
    value = value - rate * steps * np.sign(gradient)
    last = gradient
arrays["c_end"], arrays["c_step"] = value, steps
np.savez_compressed(os.path.join(os.path.dirname(os.path.abspath(__file__)), "optimiser.npz"), **arrays)
