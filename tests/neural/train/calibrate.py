#!/usr/bin/env python3
"""Fits how far a network's probabilities may be believed, on phantoms that neither training nor scores have seen.

    phantoms.py CALIBRATION --seed 2 --train 0 --unseen 32 --osteo build/release/bin/osteo
    calibrate.py MODEL_FOLDER CALIBRATION --logits build/release/bin/network_logits

Half of the cases fit temperature, bars and how far boundaries are off, the other half checks them, as it is and ruined
by blur and noise. Writes MODEL_FOLDER/calibration.json, which `osteo segment-network` reads, and what was measured into
card.md.
"""

import argparse
import json
import multiprocessing
import pathlib
import subprocess
import tempfile

import nrrd
import numpy as np
import torch
from nnunetv2.preprocessing.preprocessors.default_preprocessor import DefaultPreprocessor
from nnunetv2.utilities.plans_handling.plans_handler import PlansManager
from scipy import ndimage

from score import dice, labels_on_image, predictor_of
from train import CONFIGURATION, case_names, read_case

# As libs/imaging/neural/src/boundary.cpp has them.
STEP_MM, WIDEST_MM, OUTSIDE, INSIDE, CLASSES_MM = 0.1, 6.0, 0.1, 0.9, (0.3, 0.6, 1.2)
TEMPERATURES = np.exp(np.linspace(np.log(0.3), np.log(5), 80))
# A structure has failed where its Dice is below this part of the median.
FAILED = 0.5


def ruin(image, spacing, rng):
    """A CT that no one should trust: blurred by 0.6 to 1.5 mm, with noise of 80 to 250 HU in it."""
    blurred = ndimage.gaussian_filter(image, [rng.uniform(0.6, 1.5) / mm for mm in spacing])
    return blurred + rng.normal(0, rng.uniform(80, 250), image.shape).astype(np.float32)


def prepare(job):
    raw, folder, name, number, ruined = job
    image, labels, spacing = read_case(raw, "Ts", name)
    if ruined:
        image = ruin(image, spacing, np.random.default_rng([7, number]))
    manager = PlansManager(json.loads((folder / "plans.json").read_text()))
    dataset = json.loads((folder / "dataset.json").read_text())
    data, seg, properties = DefaultPreprocessor(verbose=False).run_case_npy(
        image[None],
        labels[None].astype(np.int16),
        {"spacing": spacing},
        manager,
        manager.get_configuration(CONFIGURATION),
        dataset,
    )
    properties.pop("class_locations", None)
    return data, np.maximum(seg[0], 0).astype(np.int16), properties, labels, spacing, image


class Case:
    """Logits on the network's grid with the truth there, and Dice by structure on the image's."""

    def __init__(self, logits, grid_spacing, prepared, classes):
        _, seg, properties, truth, spacing, _ = prepared
        self.logits, labels = logits, labels_on_image(logits, properties)
        self.truth = torch.from_numpy(seg.astype(np.int64)).to(self.logits.device)
        self.dice = [dice(labels == value, truth == value) for value in range(1, classes)]
        grid = np.prod(grid_spacing)
        found = self.logits.argmax(0)
        self.found_mm3 = [float((found == value).sum()) * grid for value in range(1, classes)]
        self.true_mm3 = [float((truth == value).sum()) * np.prod(spacing) for value in range(1, classes)]
        self.image = labels, truth, spacing, properties

    def sample(self, count, generator):
        at = torch.randint(self.truth.numel(), (count,), generator=generator).to(self.truth.device)
        return self.logits.flatten(1)[:, at].T, self.truth.flatten()[at]

    def expected_dice(self, temperature):
        """2 (sum of p over what is found) / (found + sum of p over all), by structure."""
        p = torch.softmax(self.logits.double() / temperature, 0)
        found = self.logits.argmax(0)
        rows = []
        for value in range(1, len(p)):
            here = found == value
            rows.append(float(2 * p[value][here].sum() / (here.sum() + p[value].sum())) if here.any() else 0.0)
        return rows

    def boundaries(self, temperature):
        """By structure: widths of its boundary in the probabilities and how far it is off, both in mm, by voxel."""
        labels, truth, spacing, properties = self.image
        first = [box[0] for box in properties["bbox_used_for_cropping"]]
        cropped = np.array(properties["shape_after_cropping_and_before_resampling"])
        scale = np.array(self.logits.shape[1:]) / cropped
        p = torch.softmax(self.logits.double() / temperature, 0).cpu().numpy()
        rows = []
        for value in range(1, len(p)):
            voxels = np.argwhere(at_boundary(labels, value))
            at = (voxels - first + 0.5) * scale - 0.5
            width = widths(p[value], at, np.array(spacing) / scale)
            inside = truth == value
            if inside.any() and not inside.all():
                to_out = ndimage.distance_transform_edt(inside, spacing)[tuple(voxels.T)]
                to_in = ndimage.distance_transform_edt(~inside, spacing)[tuple(voxels.T)]
                right = at_boundary(truth, value)[tuple(voxels.T)]
                off = np.where(right, 0, np.where(to_in > 0, to_in, to_out - min(spacing)))
            else:
                off = np.full(len(voxels), np.inf)
            rows.append((width, off))
        return rows


def at_boundary(labels, value):
    """Voxels of a structure that touch another label by a face."""
    inside = labels == value
    padded = np.pad(inside, 1, mode="edge")
    core = (slice(1, -1),) * 3
    whole = np.ones_like(inside)
    for axis in range(3):
        for way in (-1, 1):
            whole &= np.roll(padded, way, axis)[core]
    return inside & ~whole


def widths(p, at, mm):
    """Of the boundary of one structure, in its probability, at places on the network's grid."""

    def value(points):
        return ndimage.map_coordinates(p, points.T, order=1, mode="nearest")

    way = np.stack([(value(at - h) - value(at + h)) / m for h, m in zip(0.5 * np.eye(3), mm)], 1)
    length = np.linalg.norm(way, axis=1)
    flat = length < 1e-6
    way = np.where(flat[:, None], 0, way / np.maximum(length, 1e-300)[:, None])
    total = np.zeros(len(at))
    for sign, arrived in ((1, lambda v: v <= OUTSIDE), (-1, lambda v: v >= INSIDE)):
        reach = np.full(len(at), WIDEST_MM)
        left = np.arange(len(at))
        n = 0
        while len(left) and n * STEP_MM < WIDEST_MM:
            there = arrived(value(at[left] + sign * n * STEP_MM * way[left] / mm))
            reach[left[there]] = n * STEP_MM
            left = left[~there]
            n += 1
        total += reach
    return np.where(flat, WIDEST_MM, np.minimum(total, WIDEST_MM))


def fit_boundary(pairs, bins=16):
    """Rows of (width, the error that 95 % of such boundaries do not exceed), both ascending."""
    width, off = np.concatenate([p[0] for p in pairs]), np.concatenate([p[1] for p in pairs])
    width = np.round(width, 3)  # sums of steps, which differ by the noise of numbers
    edges = np.unique(np.quantile(width, np.linspace(0, 1, bins + 1), method="nearest"))
    rows, most = [], 0.0
    for low, high in zip(edges[:-1], edges[1:]):
        here = (width <= high) & ((width > low) | (low == edges[0]))
        if here.sum() < 50:
            continue
        most = max(most, min(float(np.quantile(off[here], 0.95)), 20.0))
        rows.append([round(float(high), 3), round(most, 3)])
    return rows or [[WIDEST_MM, 20.0]]


def classes_of(width, table):
    return np.searchsorted(CLASSES_MM, np.interp(width, *np.array(table).T), side="left")


def boundary_report(rows, measured):
    lines = []
    for n, row in enumerate(rows):
        of = np.concatenate([classes_of(case[n][0], row["boundary_mm"]) for case in measured])
        off = np.concatenate([case[n][1] for case in measured])
        cells = []
        for c, most in enumerate(CLASSES_MM):
            here = of == c
            cells.append(f"{here.mean():.0%}, {(off[here] <= most).mean():.1%}" if here.any() else "none")
        lines.append(f"| {row['name']} | {' | '.join(cells)} | {(of == len(CLASSES_MM)).mean():.0%} |")
    of = np.concatenate([classes_of(case[n][0], r["boundary_mm"]) for case in measured for n, r in enumerate(rows)])
    off = np.concatenate([case[n][1] for case in measured for n in range(len(rows))])
    held = [f"{(off[of == c] <= most).mean():.1%} of {(of == c).sum()}" for c, most in enumerate(CLASSES_MM)]
    return lines, held


def logits_by(program, folder, prepared, scratch):
    """Of Osteotome itself, which are nnunetv2's to a thousandth, in a third of the time."""
    image, spacing = prepared[5], prepared[4]
    name = scratch / f"{multiprocessing.current_process().pid}.nrrd"
    z, y, x = (float(mm) for mm in spacing)
    nrrd.write(str(name), np.ascontiguousarray(np.rint(image).astype(np.int16).T), {
        "space": "left-posterior-superior", "space directions": [[x, 0, 0], [0, y, 0], [0, 0, z]],
        "space origin": [0, 0, 0], "encoding": "raw",
    })  # fmt: skip
    out = name.with_suffix(".f16")
    done = subprocess.run([program, name, folder, out], check=True, capture_output=True, text=True)
    size = [int(n) for n in done.stdout.split()]
    return torch.from_numpy(np.fromfile(out, np.float16).reshape(size).astype(np.float32))


def fit_temperature(cases):
    """The temperature under which the truth is likeliest: the least cross entropy over sampled voxels."""
    generator = torch.Generator().manual_seed(1)
    samples = [case.sample(200000, generator) for case in cases]
    logits, truth = torch.cat([s[0] for s in samples]), torch.cat([s[1] for s in samples])
    losses = [float(torch.nn.functional.cross_entropy(logits / t, truth)) for t in TEMPERATURES]
    return float(TEMPERATURES[int(np.argmin(losses))])


def reliability(cases, temperature):
    """How far stated probability and share of right voxels lie apart, over ten bins, in voxels of no clear label."""
    generator = torch.Generator().manual_seed(2)
    samples = [case.sample(400000, generator) for case in cases]
    logits, truth = torch.cat([s[0] for s in samples]), torch.cat([s[1] for s in samples])
    unclear = torch.softmax(logits, 1).max(1).values < 0.99
    p, label = torch.softmax(logits[unclear] / temperature, 1).max(1)
    right, bins = (label == truth[unclear]).double(), (p * 10).long().clamp(0, 9)
    gaps = [
        abs(float(p[bins == b].double().mean() - right[bins == b].mean())) * int((bins == b).sum())
        for b in range(10)
        if (bins == b).any()
    ]
    return sum(gaps) / len(p)


def doubted(case, rows, temperature):
    """By structure: does the calibration say that it is not to be trusted?"""
    expected = case.expected_dice(temperature)
    return [
        not (row["least_mm3"] <= mm3 <= row["most_mm3"]) or mm3 == 0 or e < row["least_dice"]
        for row, mm3, e in zip(rows, case.found_mm3, expected)
    ]


def bars_of(cases, temperature, names):
    expected = np.array([case.expected_dice(temperature) for case in cases])
    volumes = np.array([case.true_mm3 for case in cases] + [case.found_mm3 for case in cases])
    return [
        {
            "value": n + 1,
            "name": name,
            "least_mm3": round(0.75 * float(volumes[:, n].min()), 2),
            "most_mm3": round(1.33 * float(volumes[:, n].max()), 2),
            "least_dice": lowest(expected[:, n]),
        }
        for n, name in enumerate(names)
    ]


def report(rows, temperature, fitted, whole, ruined):
    boundary, held = boundary_report(rows, [case.boundaries(temperature) for case in whole])
    _, held_ruined = boundary_report(rows, [case.boundaries(temperature) for case in ruined])
    medians = np.median([case.dice for case in fitted], 0)
    expected = np.array([case.expected_dice(temperature) for case in whole])
    error = np.abs(expected - np.array([case.dice for case in whole]))
    alarms = np.array([doubted(case, rows, temperature) for case in whole])
    flags = np.array([doubted(case, rows, temperature) for case in ruined])
    failed = np.array([case.dice for case in ruined]) < FAILED * medians
    lines = [
        f"| {row['name']} | {error[:, n].mean():.3f} | {row['least_dice']:.2f} | "
        f"{row['least_mm3']:.0f} to {row['most_mm3']:.0f} | {alarms[:, n].mean():.0%} | "
        f"{(flags & failed)[:, n].sum()} of {failed[:, n].sum()} |"
        for n, row in enumerate(rows)
    ]
    return f"""## Calibration

`calibrate.py` fitted a temperature of {temperature:.2f} and the bars on {len(fitted)} phantoms that neither training nor
scores have seen, and checked them on {len(whole)} others. Stated probability and share of right voxels lay
{reliability(whole, 1):.3f} apart without the temperature, {reliability(whole, temperature):.3f} with it (voxels of less
than 0.99, ten bins). The same {len(ruined)} cases were ruined by blur and noise; a structure has failed there with Dice
below half of its median.

| structure | expected Dice errs by | bar | mm3 | wrongly doubted | failures doubted |
|---|---|---|---|---|---|
{chr(10).join(lines)}

Wrongly doubted in all: {alarms.mean():.1%}. Failures doubted in all: {(flags & failed).sum()} of {failed.sum()}.

Where its boundaries lie: share of the voxels at a boundary that state an uncertainty of at most so many mm, and how many
of these were right, on the {len(whole)} cases that the fit had not seen (95 % are meant to be).

| structure | at most 0.3 mm | 0.6 mm | 1.2 mm | more |
|---|---|---|---|---|
{chr(10).join(boundary)}
| all | {held[0]} | {held[1]} | {held[2]} | |
| all, ruined | {held_ruined[0]} | {held_ruined[1]} | {held_ruined[2]} | |
"""


def kept(file):
    """What the networks gave at an earlier run, so that a fit can be tried again without them."""
    cases = []
    for content in torch.load(file, weights_only=False):
        cases.append(Case.__new__(Case))
        vars(cases[-1]).update(content)
    return cases


def lowest(expected):
    """Below what was met in cases that are well, by half of what these lie below their median: three reasons to doubt shall
    meet at most one good structure in twenty, and a failure lies far below."""
    least = float(expected.min())
    return round(least - 0.5 * (float(np.median(expected)) - least), 4)


def cases_of(args, found, half, dataset, device):
    jobs = [(args.raw, args.model, name, n, False) for n, name in enumerate(found)]
    jobs += [(args.raw, args.model, name, n, True) for n, name in enumerate(found) if n >= half]
    plans = PlansManager(json.loads((args.model / "plans.json").read_text()))
    spacing = plans.get_configuration(CONFIGURATION).spacing
    with multiprocessing.get_context("fork").Pool(args.threads) as pool, tempfile.TemporaryDirectory() as scratch:
        prepared = pool.imap(prepare, jobs, chunksize=1)
        predictor = None
        cases = []
        for one in prepared:
            if args.logits:
                logits = logits_by(args.logits.resolve(), args.model, one, pathlib.Path(scratch))
            else:
                predictor = predictor or predictor_of(args.model, device)
                data = torch.from_numpy(one[0])
                logits = predictor.predict_logits_from_preprocessed_data(data).float().to(predictor.device)
            cases.append(Case(logits, spacing, one, len(dataset["labels"])))
            print(len(cases), " ".join(f"{d:.2f}" for d in cases[-1].dice), flush=True)
    return cases


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("model", type=pathlib.Path, help="folder of train.py")
    parser.add_argument("raw", type=pathlib.Path, help="folder of phantoms.py with another seed, --train 0")
    parser.add_argument("--threads", type=int, default=2, help="of the processor (default 2)")
    parser.add_argument("--logits", type=pathlib.Path, help="program network_logits, in place of nnunetv2")
    parser.add_argument(
        "--keep", type=pathlib.Path, help="a file that keeps what the networks gave; taken where it is there"
    )
    parser.add_argument("--device", help="cpu or cuda (default cuda where there is one)")
    args = parser.parse_args()
    device = torch.device(args.device or ("cuda" if torch.cuda.is_available() else "cpu"))
    dataset = json.loads((args.model / "dataset.json").read_text())
    found = case_names(args.raw, "Ts")
    half = len(found) // 2
    if args.keep and args.keep.exists():
        cases = kept(args.keep)
    else:
        cases = cases_of(args, found, half, dataset, device)
        if args.keep:
            torch.save([vars(case) for case in cases], args.keep)
    fitted, whole, ruined = cases[:half], cases[half : len(found)], cases[len(found) :]
    temperature = fit_temperature(fitted)
    rows = bars_of(fitted, temperature, [name for name, value in dataset["labels"].items() if value])
    measured = [case.boundaries(temperature) for case in fitted]
    for n, row in enumerate(rows):
        row["boundary_mm"] = fit_boundary([case[n] for case in measured])
    calibration = {"osteotome_calibration": 1, "temperature": round(temperature, 4), "structures": rows}
    (args.model / "calibration.json").write_text(json.dumps(calibration, indent=1) + "\n")
    card = args.model / "card.md"
    text = card.read_text() if card.exists() else "# Card\n\n## Limits\n"
    before, _, rest = text.partition("## Calibration")
    after = "## Limits" + (rest or before).partition("## Limits")[2]
    card.write_text(before.partition("## Limits")[0] + report(rows, temperature, fitted, whole, ruined) + "\n" + after)
    print(card.read_text())


if __name__ == "__main__":
    main()
