"""numpy into a stage and back without a copy: the same memory, and what that saves. Writes no-copies.png."""

# %% How long it takes to hand voxels over, beside copying them; the shortest of seven
import time

import numpy as np
import osteo

import chart


def shortest_s(work):
    begun = time.perf_counter()
    times = []
    while len(times) < 7:
        work()
        times.append(time.perf_counter() - begun)
        begun = time.perf_counter()
    return min(times)


megabytes, over, back, copied = [], [], [], []
for edge in 32, 64, 128, 256, 400:
    voxels = np.full((edge, edge, edge), -1000, np.int16)
    megabytes.append(voxels.nbytes / 1e6)
    over.append(shortest_s(lambda: osteo.Image(voxels, spacing_mm=(0.5, 0.5, 0.5))))
    image = osteo.Image(voxels, spacing_mm=(0.5, 0.5, 0.5))
    back.append(shortest_s(lambda: image.voxels))
    copied.append(shortest_s(voxels.copy))
    print(
        f"{megabytes[-1]:6.1f} MB: in {1e6 * over[-1]:7.1f} us, out {1e6 * back[-1]:5.1f} us, numpy's copy {1e6 * copied[-1]:9.1f} us"
    )

# %% It is the same memory, on the way in and on the way out
print(
    "same memory in:", image.voxels.ctypes.data == voxels.ctypes.data, "- read-only:", not image.voxels.flags.writeable
)

# %% What a stage made lives as long as a view of it, and goes on from there without a copy too: a ball, and what is around it
z, y, x = np.indices((128, 128, 128), np.float32) - 63.5
voxels = np.where(x**2 + y**2 + z**2 < 50.0**2, 1200, -1000).astype(np.int16)
found = osteo.threshold(osteo.Image(voxels, spacing_mm=(0.5, 0.5, 0.5)), lower=500, min_volume_mm3=0).voxels
outside = osteo.Labels(1 - found, spacing_mm=(0.5, 0.5, 0.5))
print(
    "found as numpy finds it:",
    np.array_equal(found, voxels >= 500),
    f"- ball {found.sum() / 8:.0f} mm3, formula {4 / 3 * np.pi * 25 ** 3:.0f} mm3",
)
print(f"outside {np.count_nonzero(outside.voxels) / 8:.0f} mm3")

# %% The picture
osteo.save(
    chart.plot(
        [
            ("into osteo", megabytes, np.array(over) * 1e6),
            ("back to numpy", megabytes, np.array(back) * 1e6),
            ("a copy", megabytes, np.array(copied) * 1e6),
        ],
        "voxels, MB",
        "microseconds",
        log=True,
    ),
    "no-copies.png",
    force=True,
)
