#!/usr/bin/env python3
"""Fits how far a network's probabilities may be believed, on phantoms that neither training nor scores have seen.

    phantoms.py CALIBRATION --seed 2 --train 0 --unseen 32 --osteo build/release/bin/osteo
    calibrate.py MODEL_FOLDER CALIBRATION

Half of the cases fit temperature and bars, the other half checks them, as it is and ruined by blur and noise. Writes
MODEL_FOLDER/calibration.json, which `osteo segment-network` reads, and what was measured into card.md.
"""

import argparse
import json
import multiprocessing
import pathlib

import numpy as np
import torch
from nnunetv2.preprocessing.preprocessors.default_preprocessor import DefaultPreprocessor
from nnunetv2.utilities.plans_handling.plans_handler import PlansManager
from scipy import ndimage

from score import dice, labels_of, predictor_of
from train import CONFIGURATION, case_names, read_case

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
    return data, np.maximum(seg[0], 0).astype(np.int16), properties, labels, spacing


class Case:
    """Logits on the network's grid with the truth there, and Dice by structure on the image's."""

    def __init__(self, predictor, prepared, classes):
        data, seg, properties, truth, spacing = prepared
        self.logits, labels = labels_of(predictor, torch.from_numpy(data), properties)
        self.truth = torch.from_numpy(seg.astype(np.int64)).to(self.logits.device)
        self.dice = [dice(labels == value, truth == value) for value in range(1, classes)]
        grid = np.prod(predictor.configuration_manager.spacing)
        found = self.logits.argmax(0)
        self.found_mm3 = [float((found == value).sum()) * grid for value in range(1, classes)]
        self.true_mm3 = [float((truth == value).sum()) * np.prod(spacing) for value in range(1, classes)]

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
            "least_dice": round(float(np.quantile(expected[:, n], 0.05)), 4),
        }
        for n, name in enumerate(names)
    ]


def report(rows, temperature, fitted, whole, ruined):
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
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("model", type=pathlib.Path, help="folder of train.py")
    parser.add_argument("raw", type=pathlib.Path, help="folder of phantoms.py with another seed, --train 0")
    parser.add_argument("--threads", type=int, default=2, help="of the processor (default 2)")
    parser.add_argument("--device", help="cpu or cuda (default cuda where there is one)")
    args = parser.parse_args()
    device = torch.device(args.device or ("cuda" if torch.cuda.is_available() else "cpu"))
    dataset = json.loads((args.model / "dataset.json").read_text())
    found = case_names(args.raw, "Ts")
    half = len(found) // 2
    jobs = [(args.raw, args.model, name, n, False) for n, name in enumerate(found)]
    jobs += [(args.raw, args.model, name, n, True) for n, name in enumerate(found) if n >= half]
    with multiprocessing.get_context("fork").Pool(args.threads) as pool:
        prepared = pool.imap(prepare, jobs, chunksize=1)
        predictor = None
        cases = []
        for one in prepared:
            predictor = predictor or predictor_of(args.model, device)
            cases.append(Case(predictor, one, len(dataset["labels"])))
            print(len(cases), " ".join(f"{d:.2f}" for d in cases[-1].dice), flush=True)
    fitted, whole, ruined = cases[:half], cases[half : len(found)], cases[len(found) :]
    temperature = fit_temperature(fitted)
    rows = bars_of(fitted, temperature, [name for name, value in dataset["labels"].items() if value])
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
