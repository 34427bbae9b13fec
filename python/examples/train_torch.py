"""Trains a network of one's own on the benchmark's pairs."""

import torch

from srrf.torch import PairDataset

data = PairDataset(shapes=64, corruptions=["gaussian", "shear"], severities=[1, 3], seed=1)
network = torch.nn.Sequential(torch.nn.Linear(6, 64), torch.nn.ReLU(), torch.nn.Linear(64, 3))
optimizer = torch.optim.Adam(network.parameters())
for batch in torch.utils.data.DataLoader(data, batch_size=16):
    centres = torch.cat([batch["source"].mean(dim=1), batch["target"].mean(dim=1)], dim=1)
    loss = (network(centres) - batch["target_from_source"][:, :3, 3]).square().mean()
    optimizer.zero_grad(); loss.backward(); optimizer.step()
print(f"loss of the last batch: {float(loss):.3f}")
