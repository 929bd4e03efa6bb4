#!/usr/bin/env python3
"""Seeded phantoms of ears in nnU-Net's raw folder format: varied heads, voxels, kernels, noise, effusion and metal.

    python3 tests/neural/train/phantoms.py RAW --osteo build/release/bin/osteo --train 80 --unseen 20 --jobs 2

Wants numpy, scipy and pynrrd. Writes RAW/imagesTr, labelsTr (to train with), imagesTs, labelsTs (never seen by a
training), dataset.json and cases.json, which says how each case came about. Cases that are there are kept: a run that
was stopped goes on. The same arguments give the same voxels. Individuals 0 to 999 are left to demo and tests.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor

import nrrd
import numpy as np
from scipy import ndimage

# Names as `osteo demo` gives them, and the phantom's labels that make each.
STRUCTURES = {
    "facial nerve": [6],
    "sigmoid sinus": [7],
    "labyrinth": [12],
    "ossicles": [5],
    "ear canal": [18],
    "tympanic cavity": [19],
    "air cells": [17],
    "carotid artery": [15],
    "bone": [2, 3, 9],
}
LABELS = {"background": 0, **{name: n + 1 for n, name in enumerate(STRUCTURES)}}
FIRST_INDIVIDUAL = 1000


def classes_of(tissue):
    """The network's classes from the phantom's tissues; what is not named is background."""
    table = np.zeros(256, np.uint8)
    for name, values in STRUCTURES.items():
        table[values] = LABELS[name]
    return table[tissue]


def draw_case(seed, number):
    """How one case differs from others: everything that is random about it, but for the noise itself."""
    rng = np.random.default_rng([seed, number])
    spacing = round(float(rng.choice(np.arange(0.5, 0.91, 0.05))), 2)
    case = {
        "individual": FIRST_INDIVIDUAL + 10000 * (seed % 90) + number,
        "spacing_mm": spacing,
        "slice_mm": round(spacing * float(rng.choice([1, 1, 1.25])), 3),
        "noise_hu": round(float(rng.uniform(5, 50)), 1),
        "kernel": str(rng.choice(["standard", "soft", "sharp"])),
        "kernel_mm": round(float(rng.uniform(0.3, 0.6)), 2),
        "gain": round(float(rng.uniform(0.96, 1.04)), 3),
        "offset_hu": round(float(rng.uniform(-20, 20)), 1),
        "effusion": round(float(rng.uniform(0.2, 1)), 2) if rng.random() < 0.25 else 0.0,
        "metal_mm": round(float(rng.uniform(0.8, 2.5)), 2) if rng.random() < 0.2 else 0.0,
    }
    return case, rng


def pour_fluid(hu, tissue, share, rng):
    """Fills the deepest `share` of the middle ear's air with fluid, as an effusion of a lying patient."""
    air = np.isin(tissue, [17, 19])
    level = np.quantile(np.nonzero(air)[1], 1 - share)
    wet = air.copy()
    wet[:, : int(level)] = False
    # Half-filled voxels around it hold fluid instead of air as well; fluid is no denser than soft tissue.
    wet = ndimage.binary_dilation(wet) & (hu < 20)
    hu[wet] = 20 + rng.normal(0, 10, int(wet.sum()))


def place_metal(hu, classes, spacing, radius, rng):
    """A ball of metal and its streaks, each slice by itself. The ball belongs to no structure."""
    shape = np.array(hu.shape)
    centre = rng.uniform(0.2, 0.8, 3) * shape
    phases, depth = rng.uniform(0, 2 * np.pi, 4), rng.uniform(100, 350)
    for z in range(hu.shape[0]):
        up = (z - centre[0]) * spacing[0]
        if abs(up) > radius:
            continue
        y, x = np.indices(hu.shape[1:])
        y, x = (y - centre[1]) * spacing[1], (x - centre[2]) * spacing[2]
        far, angle = np.hypot(y, x), np.arctan2(y, x)
        rays = sum(np.cos((3 + 2 * n) * angle + phase) for n, phase in enumerate(phases)) / 2
        hu[z] += depth * rays / (1 + far / (4 * radius))
        ball = far**2 + up**2 < radius**2
        hu[z][ball] = 3071
        classes[z][ball] = 0


def apply_kernel(hu, case, spacing):
    blurred = ndimage.gaussian_filter(hu, [case["kernel_mm"] / mm for mm in spacing])
    if case["kernel"] == "soft":
        return blurred
    return hu + 0.7 * (hu - blurred) if case["kernel"] == "sharp" else hu


def make_case(args, kind, number):
    name = f"ear_{number:04d}"
    image, labels = args.raw / f"images{kind}" / f"{name}_0000.nrrd", args.raw / f"labels{kind}" / f"{name}.nrrd"
    case, rng = draw_case(args.seed, number)
    if labels.exists():
        return name, case
    with tempfile.TemporaryDirectory() as folder:
        ct, truth = f"{folder}/ct.nrrd", f"{folder}/labels.nrrd"
        command = [args.osteo, "phantom", ct, "--labels-out", truth, "--region", "temporal", "--quiet"]
        for flag in ("spacing_mm", "slice_mm", "noise_hu", "individual"):
            command += ["--" + flag.replace("_", "-"), str(case[flag])]
        subprocess.run(command + ["--seed", str(number + 1), "--threads", "1"], check=True)
        hu, head = nrrd.read(ct, index_order="C")
        tissue, _ = nrrd.read(truth, index_order="C")
    spacing = np.abs(np.diag(head["space directions"]))[::-1]
    hu, classes = hu.astype(np.float32), classes_of(tissue)
    if case["effusion"]:
        pour_fluid(hu, tissue, case["effusion"], rng)
    if case["metal_mm"]:
        place_metal(hu, classes, spacing, case["metal_mm"], rng)
    hu = (apply_kernel(hu, case, spacing) * case["gain"] + case["offset_hu"]).clip(-1024, 3071)
    kept = {key: head[key] for key in ("space", "space directions", "space origin", "kinds")}
    nrrd.write(str(image), np.round(hu).astype(np.int16), kept, index_order="C", compression_level=1)
    nrrd.write(str(labels), classes, kept, index_order="C", compression_level=1)
    return name, case


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("raw", type=pathlib.Path, help="folder to make")
    parser.add_argument("--osteo", default="osteo", help="the program that makes phantoms (default osteo)")
    parser.add_argument("--train", type=int, default=80, help="cases to train with (default 80)")
    parser.add_argument("--unseen", type=int, default=20, help="cases that no training sees (default 20)")
    parser.add_argument("--seed", type=int, default=1, help="of everything that is random (default 1)")
    parser.add_argument("--jobs", type=int, default=2, help="cases made at a time (default 2)")
    args = parser.parse_args()
    for folder in ("imagesTr", "labelsTr", "imagesTs", "labelsTs"):
        (args.raw / folder).mkdir(parents=True, exist_ok=True)
    work = [("Tr" if n < args.train else "Ts", n) for n in range(args.train + args.unseen)]
    with ThreadPoolExecutor(args.jobs) as pool:
        cases = dict(pool.map(lambda item: make_case(args, *item), work))
    dataset = {"channel_names": {"0": "CT"}, "labels": LABELS, "numTraining": args.train, "file_ending": ".nrrd"}
    (args.raw / "dataset.json").write_text(json.dumps(dataset, indent=1) + "\n")
    record = {"seed": args.seed, "train": args.train, "unseen": args.unseen, "cases": cases}
    (args.raw / "cases.json").write_text(json.dumps(record, indent=1) + "\n")
    print(f"{args.train} cases to train with and {args.unseen} unseen in {args.raw}")


if __name__ == "__main__":
    main()
