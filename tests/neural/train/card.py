"""The card of a network: what it was made from, how well it does, and what may not be concluded."""

import json

import numpy as np

LIMITS = """## Limits

- It has seen phantoms and nothing else: heads made of formulas, with one soft tissue, no disease but fluid in the
  middle ear, no implants but a ball of metal, and no trauma, tumour, child or earlier operation.
- The unseen cases come from the same formulas. The scores say that the training worked, not what a patient's CT gives.
- Structures thinner than two of its voxels are seen by halves: chorda tympani and stapes cannot be expected.
- Dura, brain, vein and other soft tissue are background. Bone can be found by a threshold as well.

## What may not be concluded

It must not be used for a patient. It shows how a network is trained, shipped, run and checked; it is no evidence that
such a network finds a facial nerve. A voxel that it calls background is not thereby safe to drill.
"""


def table_of(scores, cases, kept):
    rows = []
    for name, of in scores.items():
        values = np.array([of[case] for case in kept])
        worst = kept[int(values.argmin())]
        marks = [what for what in ("effusion", "metal_mm") if cases[worst][what]]
        told = f"{worst}{' (' + ', '.join(m.replace('_mm', '') for m in marks) + ')' if marks else ''}"
        rows.append(f"| {name} | {np.median(values):.3f} | {np.percentile(values, 10):.3f} | {values.min():.3f} | {told} |")
    return "\n".join(rows)


def write_card(args, facts, dataset, scores):
    record = json.loads((args.raw / "cases.json").read_text())
    kept = sorted(next(iter(scores.values())))
    size = (args.out / "fold_0" / "checkpoint_final.pth").stat().st_size / 1e6
    text = f"""# Card of the network {args.out.name}

A PlainConvUNet of nnU-Net v2 for the ear of the phantom: {", ".join(n for n, v in dataset["labels"].items() if v)}.

## How it was made

```
phantoms.py RAW --train {record["train"]} --unseen {record["unseen"]} --seed {record["seed"]}
train.py RAW {args.out.name} --seed {args.seed} --iterations {args.iterations} --batch {args.batch} \
--patch {args.patch} --spacing {args.spacing} --features {args.features} --rate {args.rate}
```

| | |
|---|---|
| data | {record["train"]} phantoms of the left temporal bone, one individual each; none of a patient |
| varied | head, voxels of 0.5 to 0.9 mm (slices to 1.1 mm), noise of 5 to 50 HU, soft and sharp kernels, HU scale |
| disease | fluid in the middle ear in a quarter of the cases, a ball of metal with streaks in a fifth |
| patches | turned by at most 11 degrees, scaled by 10 %, mirrored to right ears, made noisier |
| network | {facts["weights"]} weights, {size:.1f} MB, voxels of {args.spacing} mm, windows of {args.patch} voxels |
| training | {args.iterations} steps of {args.batch} patches, last loss {facts["loss"]:.3f}, {facts["seconds"]:.0f} s |
| machine | {facts["machine"]} |

## Scores

Dice by nnunetv2's own prediction on {len(kept)} phantoms that the training has not seen, on the grid of each image:

| structure | median | 10 % are below | worst | worst in |
|---|---|---|---|---|
{table_of(scores, record["cases"], kept)}

{LIMITS}"""
    (args.out / "card.md").write_text(text)
