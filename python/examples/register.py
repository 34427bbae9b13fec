"""Two clouds in, the pose out, in all the ways that there are."""

import numpy as np

import srrf

rng = np.random.default_rng(1)
source = rng.uniform((0, 0, 0), (3, 2, 1), (2000, 3)) ** 1.5
pose = np.array([[0.0, -1.0, 0.0, 0.4], [1.0, 0.0, 0.0, -0.2], [0.0, 0.0, 1.0, 0.7], [0.0, 0.0, 0.0, 1.0]])
target = source @ pose[:3, :3].T + pose[:3, 3]

result = srrf.register(source, target)
print(result)
print(f"right with a probability of {100 * result.probability:.0f} %; quaternion {result.quaternion_xyzw}")
if result.abstain:
    print("do not rely on it:", *result.warnings)

# One target, many sources: the network is loaded once, and the target is prepared once.
registrar = srrf.Registrar(num_threads=2)
ready = registrar.prepare(target)
for kind in ("cutout", "gaussian"):
    corrupted = srrf.corrupt(source, kind, severity=3, seed=7)
    again = registrar.register(corrupted, ready)
    print(kind, again.probability, np.abs(again.target_from_source - pose).max())
