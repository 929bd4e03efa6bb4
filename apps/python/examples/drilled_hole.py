"""A hole drilled into the mastoid, without a window: the force a hand would feel, as a structured array. Writes drilled-hole.png and drilled-hole.npy."""

# %% The bone: a phantom of the left temporal bone, as density on a sparse grid
import numpy as np
import osteo

import chart

ct, labels = osteo.phantom(region="temporal", spacing_mm=1.0)
bone, _ = osteo.resample(ct, osteo.threshold(ct, lower=500), spacing_mm=0.5, lower=500)
before = bone.dense()

# %% Where to drill: in from the side (+x is left in LPS), towards the middle of the air cells
cells = np.argwhere(labels.voxels == 17).mean(axis=0)[::-1]  # numpy's axes are z, y, x
y, z = (np.array(labels.origin_mm) + cells * labels.spacing_mm)[1:]
column = before.voxels[round((z - before.origin_mm[2]) / 0.5), round((y - before.origin_mm[1]) / 0.5)]
outside = before.origin_mm[0] + 0.5 * np.nonzero(column > 0.5)[0].max()

# %% A hand that goes in by 3 mm/s and draws back by 12; a goal for each millisecond
burr_mm = 4.0
x = outside + burr_mm / 2 + np.r_[np.linspace(1, -12, 4333), np.linspace(-12, 1, 1083)]
way = np.c_[x, np.full_like(x, y), np.full_like(x, z)]
with osteo.Rehearsal(bone, hand="spring") as rehearsal:
    ticks = rehearsal.run(osteo.goals(way, axis=(1, 0, 0), tool=f"cutting {burr_mm:g} mm"))
    after, surface, removed = rehearsal.bone().dense(), rehearsal.surface(), rehearsal.removed_mm3
np.save("drilled-hole.npy", ticks)

# %% What came of it
t_s = ticks["tick"] / 1000
force_n = np.linalg.norm(ticks["force_n"], axis=1)
depth_mm = outside + burr_mm / 2 - ticks["position_mm"][:, 0]
gone = before.voxels.sum(dtype=float) - after.voxels.sum(dtype=float)
print(f"most force {force_n.max():.2f} N at {depth_mm[force_n.argmax()]:.2f} mm of depth")
print(f"removed {removed:.3f} mm3 by the servo, {gone * 0.5 ** 3:.3f} mm3 by the densities before and after")

# %% The picture
osteo.save(
    chart.beside(
        osteo.snapshot(surface, view="left", width=440, height=360),
        chart.plot([("force on the hand", t_s, force_n)], "time, s", "force, N", 460, 360),
    ),
    "drilled-hole.png",
    force=True,
)
