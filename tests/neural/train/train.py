#!/usr/bin/env python3
"""Trains a small network on phantoms.py's cases and leaves the folder that nnU-Net v2 leaves, with its card.

    python3 -m venv build/nnunet && build/nnunet/bin/pip install nnunetv2 pynrrd
    build/nnunet/bin/python tests/neural/train/train.py RAW MODEL_FOLDER

Images are prepared by nnunetv2's own code, so that they are what a prediction will see. Where there is a GPU it is
used; the card says which machine. The same seed gives the same weights on the same machine with as many threads.
"""

import argparse
import json
import multiprocessing
import os
import pathlib
import platform
import time

for variable in ("nnUNet_raw", "nnUNet_preprocessed", "nnUNet_results"):
    os.environ.setdefault(variable, "/tmp")
os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
import nrrd
import numpy as np
import torch
import torch.nn.functional as F
from nnunetv2.preprocessing.preprocessors.default_preprocessor import DefaultPreprocessor
from nnunetv2.utilities.get_network_from_plans import get_network_from_plans
from nnunetv2.utilities.plans_handling.plans_handler import PlansManager

from card import write_card
from score import score_cases

CONFIGURATION = "3d_fullres"


def plans_of(intensities, spacing, patch, features, batch):
    stages = len(features)
    resampling = {"order": 3, "order_z": 0, "force_separate_z": None}
    return {
        "dataset_name": "Dataset001_PhantomEar",
        "plans_name": "nnUNetPlans",
        "original_median_spacing_after_transp": [spacing] * 3,
        "image_reader_writer": "SimpleITKIO",
        "transpose_forward": [0, 1, 2],
        "transpose_backward": [0, 1, 2],
        "configurations": {
            CONFIGURATION: {
                "data_identifier": "nnUNetPlans_3d_fullres",
                "preprocessor_name": "DefaultPreprocessor",
                "batch_size": batch,
                "patch_size": [patch] * 3,
                "spacing": [spacing] * 3,
                "normalization_schemes": ["CTNormalization"],
                "use_mask_for_norm": [False],
                "resampling_fn_data": "resample_data_or_seg_to_shape",
                "resampling_fn_seg": "resample_data_or_seg_to_shape",
                "resampling_fn_data_kwargs": {"is_seg": False, **resampling},
                "resampling_fn_seg_kwargs": {"is_seg": True, **resampling, "order": 1},
                "resampling_fn_probabilities": "resample_data_or_seg_to_shape",
                "resampling_fn_probabilities_kwargs": {"is_seg": False, **resampling, "order": 1},
                "architecture": {
                    "network_class_name": "dynamic_network_architectures.architectures.unet.PlainConvUNet",
                    "arch_kwargs": {
                        "n_stages": stages,
                        "features_per_stage": features,
                        "conv_op": "torch.nn.modules.conv.Conv3d",
                        "kernel_sizes": [[3, 3, 3]] * stages,
                        "strides": [[1, 1, 1]] + [[2, 2, 2]] * (stages - 1),
                        "n_conv_per_stage": [2] * stages,
                        "n_conv_per_stage_decoder": [1] * (stages - 1),
                        "conv_bias": True,
                        "norm_op": "torch.nn.modules.instancenorm.InstanceNorm3d",
                        "norm_op_kwargs": {"eps": 1e-05, "affine": True},
                        "dropout_op": None,
                        "dropout_op_kwargs": None,
                        "nonlin": "torch.nn.LeakyReLU",
                        "nonlin_kwargs": {"inplace": True},
                    },
                    "_kw_requires_import": ["conv_op", "norm_op", "dropout_op", "nonlin"],
                },
                "batch_dice": True,
            }
        },
        "experiment_planner_used": "ExperimentPlanner",
        "label_manager": "LabelManager",
        "foreground_intensity_properties_per_channel": {"0": intensities},
    }


def read_case(raw, kind, name):
    image, head = nrrd.read(str(raw / f"images{kind}" / f"{name}_0000.nrrd"), index_order="C")
    labels, _ = nrrd.read(str(raw / f"labels{kind}" / f"{name}.nrrd"), index_order="C")
    spacing = np.abs(np.diag(head["space directions"]))[::-1]
    return image.astype(np.float32), labels, [float(mm) for mm in spacing]


def case_names(raw, kind):
    return sorted(path.name[: -len("_0000.nrrd")] for path in (raw / f"images{kind}").glob("*_0000.nrrd"))


def intensities_of(raw, names):
    """Of voxels of all structures, as nnU-Net's fingerprint has them; 20 cases are enough for the percentiles."""
    rng, drawn = np.random.default_rng(1234), []
    for name in names[:: max(1, len(names) // 20)]:
        image, labels, _ = read_case(raw, "Tr", name)
        drawn.append(rng.choice(image[labels > 0], 10000))
    values = np.concatenate(drawn)
    low, high = np.percentile(values, [0.5, 99.5])
    numbers = {"max": values.max(), "mean": values.mean(), "median": np.median(values), "min": values.min()}
    numbers |= {"percentile_00_5": low, "percentile_99_5": high, "std": values.std()}
    return {key: float(value) for key, value in numbers.items()}


def prepare_case(job):
    """An image as the network sees it, with its labels on the same grid, kept beside the raw data."""
    raw, cache, kind, name, plans, dataset = job
    path = cache / f"{name}.npz"
    if not path.exists():
        image, labels, spacing = read_case(raw, kind, name)
        manager = PlansManager(plans)
        configuration = manager.get_configuration(CONFIGURATION)
        data, seg, _ = DefaultPreprocessor(verbose=False).run_case_npy(
            image[None], labels[None].astype(np.int16), {"spacing": spacing}, manager, configuration, dataset
        )
        np.savez(path, data=data[0].astype(np.float16), seg=np.maximum(seg[0], 0).astype(np.uint8))
    return path


class Cases:
    """Prepared volumes on the device, and patches out of them, turned, scaled, mirrored and made noisy."""

    def __init__(self, paths, patch, classes, seed, device):
        self.patch, self.device, self.classes = patch, device, classes
        self.rng = np.random.default_rng(seed)
        self.noise = torch.Generator(device).manual_seed(seed)
        self.volumes, self.places, voxels = [], [], np.zeros(classes)
        for path in paths:
            with np.load(path) as case:
                data, seg = case["data"].astype(np.float32), case["seg"]
            voxels += np.bincount(seg.ravel(), minlength=classes)
            spots = [np.argwhere(seg == value) for value in range(1, classes)]
            self.places.append([s[self.rng.permutation(len(s))[:2000]] for s in spots])
            self.volumes.append((torch.from_numpy(data).to(device), torch.from_numpy(seg).float().to(device)))
        # How much rarer a class is than the commonest; its root is how much more its voxels count at first.
        self.rarity = voxels.max() / np.maximum(voxels, 1)
        self.share = self.rarity[1:] ** 0.25 / (self.rarity[1:] ** 0.25).sum()
        line = torch.arange(patch, device=device, dtype=torch.float32) - (patch - 1) / 2
        # grid_sample counts x, y, z.
        self.grid = torch.stack(torch.meshgrid(line, line, line, indexing="ij")[::-1], -1).reshape(-1, 3)

    def centre(self, number):
        """Two patches of three hold a structure, the rare ones more often; the others lie anywhere."""
        size = np.array(self.volumes[number][0].shape)
        at = self.rng.uniform(0, size)
        wanted = self.places[number][self.rng.choice(self.classes - 1, p=self.share)]
        if self.rng.random() < 0.67 and len(wanted):
            at = wanted[self.rng.integers(len(wanted))] + self.rng.uniform(-0.25, 0.25, 3) * self.patch
        half = self.patch / 2
        at = np.clip(at, np.minimum(half, size / 2), np.maximum(size - half, size / 2))
        return np.floor(at) - 0.5 * (1 - self.patch % 2)

    def turn(self):
        """Left ears become right ones in half of the patches; heads lie a little differently in half of them."""
        matrix = np.eye(3)
        if self.rng.random() < 0.5:
            for axis, angle in enumerate(self.rng.uniform(-0.2, 0.2, 3)):
                i, j = [a for a in range(3) if a != axis]
                turn = np.eye(3)
                turn[i, i] = turn[j, j] = np.cos(angle)
                turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
                matrix = matrix @ turn
            matrix = matrix * self.rng.uniform(0.9, 1.1)
        if self.rng.random() < 0.5:
            matrix[:, 0] *= -1
        return matrix

    def draw(self):
        number = self.rng.integers(len(self.volumes))
        data, seg = self.volumes[number]
        centre, matrix = self.centre(number), self.turn()
        at = self.grid @ torch.tensor(matrix.T, dtype=torch.float32, device=self.device)
        at = at + torch.tensor(centre[::-1].copy(), dtype=torch.float32, device=self.device)
        last = torch.tensor(data.shape[::-1], dtype=torch.float32, device=self.device) - 1
        at = (2 * at / last - 1).reshape(1, self.patch, self.patch, self.patch, 3)
        image = F.grid_sample(data[None, None], at, "bilinear", "border", align_corners=True)
        labels = F.grid_sample(seg[None, None], at, "nearest", "border", align_corners=True)[0, 0].long()
        if self.rng.random() < 0.3:
            image = image + self.rng.uniform(0, 0.1) * torch.randn(
                image.shape, generator=self.noise, device=self.device
            )
        image = image * self.rng.uniform(0.9, 1.1) + self.rng.uniform(-0.1, 0.1)
        return image[0], labels

    def batch(self, count):
        images, labels = zip(*[self.draw() for _ in range(count)])
        return torch.stack(images), torch.stack(labels)


def loss_of(outputs, labels, weights):
    """Weighted cross entropy and Dice of the batch, at each resolution half as much as at the finer one.

    Classes that a batch has not are left out of Dice: there it would only teach a network never to name a rare one.
    """
    total, shares = 0, 0
    for level, logits in enumerate(outputs):
        step = labels.shape[-1] // logits.shape[-1]
        truth = labels[:, ::step, ::step, ::step]
        hot = torch.zeros_like(logits).scatter_(1, truth[:, None], 1)
        log = F.log_softmax(logits, 1)
        axes = (0, 2, 3, 4)
        there = hot.sum(axes)
        both, sum_of = (log.exp() * hot).sum(axes), log.exp().sum(axes) + there
        kept = (there[1:] > 0).float()
        dice = (2 * both[1:] / sum_of[1:].clamp_min(1e-5) * kept).sum() / kept.sum().clamp_min(1)
        entropy = -((log * hot).sum(axes) * weights).sum() / (there * weights).sum()
        total, shares = total + (entropy - dice) / 2**level, shares + 1 / 2**level
    return total / shares


def train(network, cases, args, save):
    """AdamW, a short warm-up, then a cosine down to nothing."""
    optimizer = torch.optim.AdamW(network.parameters(), lr=args.rate, weight_decay=1e-4)
    warm = min(50, args.iterations // 10 + 1)

    def share(n):
        return (n + 1) / warm if n < warm else (1 + np.cos(np.pi * (n - warm) / max(args.iterations - warm, 1))) / 2

    schedule = torch.optim.lr_scheduler.LambdaLR(optimizer, share)
    begin, losses = time.time(), []
    network.train()
    rarity = torch.tensor(cases.rarity, dtype=torch.float32, device=cases.device)
    for n in range(args.iterations):
        images, labels = cases.batch(args.batch)
        # Rare classes count more until they are found, and as any other in the end.
        loss = loss_of(network(images), labels, rarity ** (0.5 * (1 - n / args.iterations)))
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 12)
        optimizer.step()
        schedule.step()
        losses.append(float(loss.detach()))
        if (n + 1) % 50 == 0 or n + 1 == args.iterations:
            seconds = time.time() - begin
            print(f"{n + 1} of {args.iterations}: loss {np.mean(losses[-50:]):.3f}, {seconds:.0f} s", flush=True)
        if (n + 1) % 500 == 0:
            save(n + 1)
    save(args.iterations)
    return time.time() - begin, float(np.mean(losses[-50:]))


def save_checkpoint(path, network, plans, dataset, iteration):
    """What nnU-Net's trainer saves, without the optimizer's state, which is twice the size of the weights."""
    path.parent.mkdir(parents=True, exist_ok=True)
    weights = {key: value.detach().cpu() for key, value in network.state_dict().items()}
    # One network has some weights under several names; on the way to the file they must stay one.
    kept = {value.data_ptr(): weights[key] for key, value in network.state_dict().items()}
    torch.save(
        {
            "network_weights": {key: kept[value.data_ptr()] for key, value in network.state_dict().items()},
            "optimizer_state": {},
            "grad_scaler_state": None,
            "logging": {},
            "_best_ema": None,
            "current_epoch": iteration,
            "init_args": {
                "plans": plans,
                "configuration": CONFIGURATION,
                "fold": 0,
                "dataset_json": dataset,
                "device": torch.device("cpu"),
            },
            "trainer_name": "nnUNetTrainer",
            "inference_allowed_mirroring_axes": (2,),
        },
        path,
    )


def build(plans, dataset):
    manager = PlansManager(json.loads(json.dumps(plans)))
    configuration = manager.get_configuration(CONFIGURATION)
    heads = manager.get_label_manager(dataset).num_segmentation_heads
    network = get_network_from_plans(
        configuration.network_arch_class_name,
        configuration.network_arch_init_kwargs,
        configuration.network_arch_init_kwargs_req_import,
        1,
        heads,
        deep_supervision=True,
    )
    return network, heads


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("raw", type=pathlib.Path, help="folder of phantoms.py")
    parser.add_argument("out", type=pathlib.Path, help="model folder to make")
    parser.add_argument("--seed", type=int, default=1, help="of weights and patches (default 1)")
    parser.add_argument("--iterations", type=int, default=1500, help="steps of the training (default 1500)")
    parser.add_argument("--batch", type=int, default=2, help="patches a step (default 2)")
    parser.add_argument("--patch", type=int, default=64, help="edge of a patch in voxels (default 64)")
    parser.add_argument("--spacing", type=float, default=0.7, help="edge of the network's voxels in mm (default 0.7)")
    parser.add_argument("--features", default="8,16,32,64", help="channels of each stage (default 8,16,32,64)")
    parser.add_argument("--rate", type=float, default=2e-3, help="largest learning rate (default 0.002)")
    parser.add_argument("--threads", type=int, default=2, help="of the processor (default 2)")
    parser.add_argument("--device", help="cpu or cuda (default cuda where there is one)")
    parser.add_argument("--skip-scores", action="store_true", help="leave the unseen cases alone, and write no card")
    return parser.parse_args()


def main():
    args = arguments()
    device = torch.device(args.device or ("cuda" if torch.cuda.is_available() else "cpu"))
    torch.set_num_threads(args.threads)
    torch.manual_seed(args.seed)
    torch.backends.cudnn.benchmark = False
    torch.backends.cudnn.deterministic = True
    features = [int(n) for n in args.features.split(",")]
    dataset = json.loads((args.raw / "dataset.json").read_text())
    begin = time.time()
    names = case_names(args.raw, "Tr")
    plans = plans_of(intensities_of(args.raw, names), args.spacing, args.patch, features, args.batch)
    cache = args.raw / f"prepared-{args.spacing}-{len(names)}"
    cache.mkdir(exist_ok=True)
    jobs = [(args.raw, cache, "Tr", name, plans, dataset) for name in names]
    with multiprocessing.get_context("fork").Pool(args.threads) as pool:
        paths = pool.map(prepare_case, jobs, chunksize=1)
    print(f"{len(paths)} cases prepared, {time.time() - begin:.0f} s", flush=True)

    network, classes = build(plans, dataset)
    network = network.to(device)
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / "plans.json").write_text(json.dumps(plans, indent=1) + "\n")
    (args.out / "dataset.json").write_text(json.dumps(dataset, indent=1) + "\n")
    checkpoint = args.out / "fold_0" / "checkpoint_final.pth"
    cases = Cases(paths, args.patch, classes, args.seed, device)
    seconds, loss = train(network, cases, args, lambda n: save_checkpoint(checkpoint, network, plans, dataset, n))
    if args.skip_scores:
        return
    where = torch.cuda.get_device_name() if device.type == "cuda" else f"{platform.machine()}, {args.threads} threads"
    facts = {
        "weights": sum(p.numel() for p in network.parameters()),
        "machine": f"{where}, PyTorch {torch.__version__}",
        "seconds": seconds,
        "loss": loss,
    }
    unseen = [(name, *read_case(args.raw, "Ts", name)) for name in case_names(args.raw, "Ts")]
    write_card(args, facts, dataset, score_cases(args.out, unseen, dataset, device, args.threads))
    print(f"{args.out}/card.md is written, {time.time() - begin:.0f} s in all")


if __name__ == "__main__":
    main()
