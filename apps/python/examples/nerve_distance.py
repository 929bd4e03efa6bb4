"""From a CT to bone, and how far each part of the bone is from the facial nerve. Writes nerve-distance.png."""

# %% A CT: of a phantom, whose tissues are known. osteo.load("ct.nrrd") or osteo.import_("dicom-folder") gives a real one
import numpy as np
import osteo

import chart

ct, labels = osteo.phantom(region="temporal", spacing_mm=0.8)
NERVE = 6  # what each value of the labels means: help(osteo.phantom)

# %% Bone, its surface, and the distance of every voxel to the nerve
mask = osteo.threshold(ct, lower=500)
bone, _ = osteo.resample(ct, mask, spacing_mm=0.5, lower=500)
surface = osteo.surface(bone)
distance = osteo.distance(labels, structure=str(NERVE), region="box").distance.dense(lo=(0, 0, 0), shape=labels.shape)

# %% Numbers: numpy works on the voxels as they are, none was copied. A few distances once more, by hand
in_bone = mask.voxels == 1
voxel_mm3 = np.prod(ct.spacing_mm)
print(
    f"bone {in_bone.sum() * voxel_mm3 / 1000:.2f} cm3, as fractions of voxels {bone.dense().voxels.sum(dtype=float) * 0.5 ** 3 / 1000:.2f} cm3"
)
for mm in 1, 2, 4:
    print(f"nearer to the nerve than {mm} mm: {(in_bone & (distance.voxels < mm)).sum() * voxel_mm3:.0f} mm3")
some = np.argwhere(in_bone)[::997]
nerve = np.argwhere(labels.voxels == NERVE)
apart = np.sqrt((((some[:, None] - nerve) * ct.spacing_mm[::-1]) ** 2).sum(axis=2)).min(axis=1)
print(
    f"largest difference to {len(some)} distances taken by numpy: {np.abs(apart - distance.voxels[tuple(some.T)]).max():.1e} mm"
)

# %% A slice: the CT in grey, bone within 8 mm coloured from red (near) to blue, lines each 2 mm, the nerve yellow
z = np.bincount(nerve[:, 0]).argmax()
hu, mm, is_bone, is_nerve = (
    chart.enlarged(v, 3) for v in (ct.voxels[z], distance.voxels[z], in_bone[z], labels.voxels[z] == NERVE)
)
grey = np.clip((hu + 300) / 2000, 0, 1)[..., None] * [255, 255, 255]
far = np.clip(mm / 8, 0, 1)[..., None]
picture = np.where(
    ((is_bone > 0.5) & (mm < 8))[..., None], 0.4 * grey + 0.6 * ((1 - far) * [214, 50, 40] + far * [50, 110, 200]), grey
)
ring = np.floor(np.clip(mm, 0, 8) / 2)
picture[(ring != np.roll(ring, 1, 0)) | (ring != np.roll(ring, 1, 1))] = 255
picture[is_nerve > 0.5] = [255, 220, 40]

# %% Beside it the bone in 3D
osteo.save(
    chart.beside(picture.astype(np.uint8), osteo.snapshot(surface, view="left", width=400, height=len(picture))),
    "nerve-distance.png",
    force=True,
)
