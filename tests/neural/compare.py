#!/usr/bin/env python3
"""`osteo segment-network` beside nnunetv2 itself: equal labels, processor time and memory, six networks on phantoms.

    build/nnunet/bin/python tests/neural/compare.py RAW --osteo build/release/bin/osteo --cases 20 --out build/compare

RAW is a folder of train/phantoms.py, whose unseen cases are cut to boxes. Networks have seeded weights, and a bias that
brings each class about. Both run on the same cores and mirror as their checkpoints say. Prints a table. Exit code 1 when
fewer than 99.99 % of the voxels are equal in any network.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys

import nrrd
import numpy as np

from make_golden import architecture, make_model, plans_of, predict, write_nrrd

KERNELS, STRIDES = [[3, 3, 3]] * 4, [[1, 1, 1]] + [[2, 2, 2]] * 3
PLAIN = ("PlainConvUNet", 3, [16, 32, 64, 96], KERNELS, STRIDES, [2] * 4, [2] * 3)
LABELS = {"background": 0, "nerve": 1, "sinus": 2, "canal": 3, "cells": 4}


def three(name, spacing, network, **more):
    return dict({"patch_size": [40, 40, 40], "spacing": spacing, "architecture": architecture(*network)}, **more)


def case(name, configuration, labels=LABELS, others=None, **dataset):
    return dict(
        name=name, folds=1, mirror=(0, 1), dataset=dict({"labels": labels}, **dataset),
        plans=plans_of(name, configuration, others=others),
    )  # fmt: skip


COARSE = plans_of("3d_lowres", three("3d_lowres", [1.4] * 3, PLAIN))["configurations"]
NETWORKS = {
    "plain": case("3d_fullres", three("3d_fullres", [0.7] * 3, PLAIN)),
    "residual": case(
        "3d_fullres",
        three("3d_fullres", [0.8, 0.6, 0.6], ("ResidualEncoderUNet", *PLAIN[1:5], [1, 2, 2, 2], [1] * 3)),
    ),
    "batch norm": case("3d_fullres", three("3d_fullres", [0.75] * 3, (*PLAIN, "Batch"))),
    "regions": case(
        "3d_lowres", three("3d_lowres", [1.0] * 3, PLAIN),
        {"background": 0, "ear": [1, 2, 3], "canal": [2, 3], "drum": 3}, regions_class_order=[1, 2, 3],
    ),
    "2d": case(
        "2d",
        {
            "patch_size": [64, 64],
            "spacing": [0.6, 0.6],
            "architecture": architecture(
                "PlainConvUNet", 2, [16, 32, 64], [[3, 3]] * 3, [[1, 1], [2, 2], [2, 2]], [2] * 3, [2] * 2
            ),
        },
    ),
    "cascade": case(
        "3d_cascade_fullres", three("3d_cascade_fullres", [0.7] * 3, PLAIN, previous_stage="3d_lowres"), others=COARSE
    ),
}  # fmt: skip


def box_of(raw, name, size):
    image, head = nrrd.read(str(next((raw / "imagesTs").glob(name + "*.nrrd"))))
    image = np.transpose(np.round(image)).astype(np.int16)  # z, y, x
    first = [max(0, (n - size) // 2) for n in image.shape]
    return (
        np.ascontiguousarray(image[tuple(slice(f, f + size) for f in first)]),
        [float(np.linalg.norm(row)) for row in head["space directions"]][::-1],
    )


def reference(folder, before, boxes, out):
    """In a process of its own: labels of each box by nnunetv2; seconds of the processor and bytes at most."""
    code = (
        "import sys,json,time,resource,numpy as np;sys.path.insert(0,sys.argv[1]);from make_golden import predict;"
        "import pathlib,torch;torch.set_num_threads(int(sys.argv[2]));jobs=json.loads(sys.argv[3]);spent=0\n"
        "for j in jobs:\n"
        "  image=np.load(j['image']);b=np.load(j['before']) if j['before'] else None;t=time.process_time()\n"
        "  labels,logits=predict(pathlib.Path(j['folder']),image,j['spacing'],b);spent+=time.process_time()-t\n"
        "  np.save(j['out'],labels)\n"
        "print('RESULT',spent,resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    jobs = []
    for n, (image, spacing) in enumerate(boxes):
        np.save(out / f"{n}.npy", image)
        jobs.append(
            {
                "folder": str(folder), "image": str(out / f"{n}.npy"), "spacing": spacing,
                "before": str(before / f"{n}-labels.npy") if before else None, "out": str(out / f"{n}-labels.npy"),
            }  # fmt: skip
        )
    here = str(pathlib.Path(__file__).parent)
    done = subprocess.run(
        [sys.executable, "-c", code, here, str(os.cpu_count()), json.dumps(jobs)], capture_output=True, text=True
    )
    line = [l for l in done.stdout.splitlines() if l.startswith("RESULT")]
    if not line:
        sys.exit(done.stdout[-2000:] + done.stderr[-3000:])
    return float(line[0].split()[1]), int(line[0].split()[2]) * 1024


def ours(osteo, folder, boxes, out):
    spent, most = 0.0, 0
    for n, (image, spacing) in enumerate(boxes):
        write_nrrd(out / f"{n}.nrrd", image, spacing)
        # A small process starts it: what a process was before its exec counts as its memory.
        watch = (
            "import os,sys;p=os.spawnv(os.P_NOWAIT,sys.argv[1],sys.argv[1:]);_,s,u=os.wait4(p,0);"
            "print(s,u.ru_utime+u.ru_stime,u.ru_maxrss)"
        )
        command = [osteo, "segment-network", out / f"{n}.nrrd", folder, out / f"{n}-ours.nrrd", "--quiet", "--force"]
        done = subprocess.run([sys.executable, "-S", "-c", watch, *command], capture_output=True, text=True)
        status, seconds, kilobytes = done.stdout.split()[-3:]
        if int(status):
            sys.exit(f"osteo failed on box {n} of {folder}: {done.stderr}")
        spent += float(seconds)
        most = max(most, int(kilobytes) * 1024)
    return spent, most


def bias_of(folder, network, image, spacing, before=None):
    make_model(folder, network, 77)
    _, logits = predict(folder, image, spacing, before)
    make_model(folder, network, 77, -np.median(logits.astype(np.float32), axis=(1, 2, 3)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("raw", type=pathlib.Path)
    parser.add_argument("--osteo", type=pathlib.Path, required=True)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--size", type=int, default=60, help="of the boxes, in voxels")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--only", choices=NETWORKS)
    args = parser.parse_args()
    names = sorted(p.name.split("_0000")[0] for p in (args.raw / "imagesTs").glob("*.nrrd"))[: args.cases]
    boxes = [box_of(args.raw, name, args.size) for name in names]
    worst = 1.0
    print("| network | labels equal | worst box | time, of nnunetv2's | memory, of nnunetv2's |\n|---|---|---|---|---|")
    for name, network in NETWORKS.items():
        if args.only and name != args.only:
            continue
        out = args.out / name.replace(" ", "-")
        folder = out / ("T__P__" + network["name"])
        folder.mkdir(parents=True, exist_ok=True)
        seconds, bytes_, before = 0.0, 0, None
        if "previous_stage" in network["plans"]["configurations"][network["name"]]:
            first = out / "T__P__3d_lowres"
            lowres = dict(network, name="3d_lowres")
            bias_of(first, lowres, *boxes[0])
            before = out / "before"
            before.mkdir(exist_ok=True)
            seconds, bytes_ = reference(first, None, boxes, before)
        bias_of(folder, network, *boxes[0], np.load(before / "0-labels.npy") if before else None)
        theirs = reference(folder, before, boxes, out)
        seconds, bytes_ = seconds + theirs[0], max(bytes_, theirs[1])
        spent, most = ours(args.osteo, folder, boxes, out)
        shares = []
        for n, (image, _) in enumerate(boxes):
            got = np.transpose(nrrd.read(str(out / f"{n}-ours.nrrd"))[0])
            shares.append(float((got == np.load(out / f"{n}-labels.npy")).mean()))
        worst = min(worst, float(np.mean(shares)))
        print(
            f"| {name} | {100 * np.mean(shares):.4f} % | {100 * min(shares):.4f} % | {spent / seconds:.2f} "
            f"({spent:.0f} of {seconds:.0f} s) | {most / bytes_:.2f} ({most / 1e6:.0f} of {bytes_ / 1e6:.0f} MB) |",
            flush=True,
        )
    return 0 if worst >= 0.9999 else 1


if __name__ == "__main__":
    sys.exit(main())
