"""A strip of bone that bends: surface, tetrahedra, finite elements, and the formula beside them. Writes bent-beam.png."""

# %% A strip as a surface: 60 x 6 x 6 mm, of cortical bone, held at x = 0, pressed with 100 N at its other end
import numpy as np
import osteo

import chart

LONG, HIGH, YOUNG_MPA, POISSON, FORCE_N = 60.0, 6.0, 17000.0, 0.3, 100.0
corners = np.array([(x, y, z) for z in (0, HIGH) for y in (0, HIGH) for x in (0, LONG)], np.float32)
faces = np.array(
    [
        (0, 2, 3),
        (0, 3, 1),
        (4, 5, 7),
        (4, 7, 6),
        (0, 1, 5),
        (0, 5, 4),
        (2, 6, 7),
        (2, 7, 3),
        (0, 4, 6),
        (0, 6, 2),
        (1, 3, 7),
        (1, 7, 5),
    ],
    np.uint32,
)
strip = osteo.Surface(corners, faces)
problem = {
    "osteotome_tissue": 1,
    "material": {"young_kpa": YOUNG_MPA * 1000, "poisson": POISSON},
    "fixed": [{"box_mm": [[-0.1, -1, -1], [0.1, 7, 7]]}],
    "loads": [
        {
            "name": "press",
            "forces": [{"box_mm": [[LONG - 0.1, -1, -1], [LONG + 0.1, 7, 7]], "total_n": [0, 0, -FORCE_N]}],
        }
    ],
}


# %% What a beam does by the formula (Timoshenko): bending, and a little shear
def formula_mm(x):
    area, inertia, shear_mpa = HIGH**2, HIGH**4 / 12, YOUNG_MPA / (2 * (1 + POISSON))
    return -FORCE_N * (x**2 * (3 * LONG - x) / (6 * YOUNG_MPA * inertia) + x / (5 / 6 * shear_mpa * area))


# %% What the elements do: linear tetrahedra are far too stiff, quadratic ones are not
curves = []
for spacing, order in (3, "t4"), (3, "t10"), (1.5, "t10"):
    mesh = osteo.tetrahedralize(strip, method="grid", spacing_mm=spacing)
    bent = osteo.fem(mesh, problem, law="linear", order=order).deformed
    x, sunk = mesh.points_mm[:, 0], bent.points_mm[:, 2] - mesh.points_mm[:, 2]
    along = np.unique(x)
    curves.append((f"{order}, {spacing:g} mm", along, [sunk[x == at].mean() for at in along]))
    print(
        f"{order} of {spacing:g} mm: tip {curves[-1][2][-1]:.4f} mm, formula {formula_mm(LONG):.4f} mm, "
        f"{100 * (curves[-1][2][-1] / formula_mm(LONG) - 1):+.2f} %"
    )

# %% The picture: the bent strip, and how far it sank along its length
at = np.linspace(0, LONG, 61)
osteo.save(
    chart.beside(
        osteo.snapshot(bent, view="front", width=440, height=360),
        chart.plot(
            [("formula", at, formula_mm(at)), *reversed(curves)],
            "along the strip, mm",
            "sunk, mm",
            520,
            360,
            dots=[c[0] for c in curves],
        ),
    ),
    "bent-beam.png",
    force=True,
)
