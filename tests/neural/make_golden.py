#!/usr/bin/env python3
"""Small networks with seeded weights in nnU-Net's folder format, and what nnunetv2 makes of a seeded image with them.

    python3 -m venv build/nnunet && build/nnunet/bin/pip install nnunetv2 pynrrd onnx onnxscript
    build/nnunet/bin/python tests/neural/make_golden.py testdata/neural

Writes per case: the model's folder, image.nrrd, labels.nrrd and logits.f16 (class by class, on the network's grid).
The unit tests of `neural` compare with these; neither Python nor torch is wanted there.
"""

import json
import os
import pathlib
import sys

os.environ.setdefault("nnUNet_raw", "/tmp")
os.environ.setdefault("nnUNet_preprocessed", "/tmp")
os.environ.setdefault("nnUNet_results", "/tmp")
import numpy as np
import onnx
import torch
from nnunetv2.inference.predict_from_raw_data import nnUNetPredictor
from nnunetv2.utilities.get_network_from_plans import get_network_from_plans
from nnunetv2.utilities.label_handling.label_handling import determine_num_input_channels
from nnunetv2.utilities.plans_handling.plans_handler import PlansManager

CT = {
    "0": {
        "max": 3071.0,
        "mean": 312.5,
        "median": 250.0,
        "min": -1024.0,
        "percentile_00_5": -950.0,
        "percentile_99_5": 1730.25,
        "std": 401.75,
    }
}


def architecture(kind, dim, features, kernels, strides, blocks, decoder, norm="Instance"):
    return {
        "network_class_name": "dynamic_network_architectures.architectures.unet." + kind,
        "arch_kwargs": {
            "n_stages": len(features),
            "features_per_stage": features,
            "conv_op": f"torch.nn.modules.conv.Conv{dim}d",
            "kernel_sizes": kernels,
            "strides": strides,
            ("n_conv_per_stage" if kind == "PlainConvUNet" else "n_blocks_per_stage"): blocks,
            "n_conv_per_stage_decoder": decoder,
            "conv_bias": True,
            "norm_op": f"torch.nn.modules.{norm.lower()}norm.{norm}Norm{dim}d",
            "norm_op_kwargs": {"eps": 1e-05, "affine": True},
            "dropout_op": None,
            "dropout_op_kwargs": None,
            "nonlin": "torch.nn.LeakyReLU",
            "nonlin_kwargs": {"inplace": True},
        },
        "_kw_requires_import": ["conv_op", "norm_op", "dropout_op", "nonlin"],
    }


def plans_of(name, configuration, transpose=(0, 1, 2), others=None):
    configuration = dict(
        {
            "data_identifier": "nnUNetPlans_" + name,
            "preprocessor_name": "DefaultPreprocessor",
            "batch_size": 2,
            "normalization_schemes": ["CTNormalization"],
            "use_mask_for_norm": [False],
            "resampling_fn_data": "resample_data_or_seg_to_shape",
            "resampling_fn_seg": "resample_data_or_seg_to_shape",
            "resampling_fn_data_kwargs": {"is_seg": False, "order": 3, "order_z": 0, "force_separate_z": None},
            "resampling_fn_seg_kwargs": {"is_seg": True, "order": 1, "order_z": 0, "force_separate_z": None},
            "resampling_fn_probabilities": "resample_data_or_seg_to_shape",
            "resampling_fn_probabilities_kwargs": {"is_seg": False, "order": 1, "order_z": 0, "force_separate_z": None},
            "batch_dice": True,
        },
        **configuration,
    )
    back = [int(i) for i in np.argsort(transpose)]
    return {
        "dataset_name": "Dataset001_Seeded",
        "plans_name": "nnUNetPlans",
        "image_reader_writer": "SimpleITKIO",
        "transpose_forward": list(transpose),
        "transpose_backward": back,
        "configurations": dict({name: configuration}, **(others or {})),
        "foreground_intensity_properties_per_channel": CT,
        "experiment_planner_used": "ExperimentPlanner",
        "label_manager": "LabelManager",
    }


CASES = {
    # Plans of before 2.5; two folds, all axes mirrored, an ignore label.
    "plain": dict(
        name="3d_fullres",
        folds=2,
        mirror=(0, 1, 2),
        spacing=(1.1, 0.9, 0.8),
        shape=(15, 20, 27),
        zeros=2,
        plans=plans_of(
            "3d_fullres",
            {
                "patch_size": [8, 16, 16],
                "spacing": [1.3, 0.75, 0.75],
                "UNet_class_name": "PlainConvUNet",
                "UNet_base_num_features": 5,
                "unet_max_num_features": 18,
                "n_conv_per_stage_encoder": [2, 2, 1],
                "n_conv_per_stage_decoder": [1, 2],
                "num_pool_per_axis": [1, 2, 2],
                "pool_op_kernel_sizes": [[1, 1, 1], [1, 2, 2], [2, 2, 2]],
                "conv_kernel_sizes": [[1, 3, 3], [3, 3, 3], [3, 3, 3]],
            },
        ),
        dataset={"labels": {"background": 0, "nerve": 1, "sinus": 2, "canal": 3, "ignore": 4}},
    ),
    # Regions, thick slices resampled each by itself, axes exchanged.
    "residual": dict(
        name="3d_lowres",
        folds=1,
        mirror=(1, 2),
        spacing=(0.7, 2.5, 0.7),
        shape=(22, 9, 24),
        zeros=0,
        plans=plans_of(
            "3d_lowres",
            {
                "patch_size": [8, 16, 16],
                "spacing": [2.2, 0.8, 0.75],
                "architecture": architecture(
                    "ResidualEncoderUNet",
                    3,
                    [6, 10, 17],
                    [[1, 3, 3], [3, 3, 3], [3, 3, 3]],
                    [[1, 1, 1], [1, 2, 2], [2, 2, 2]],
                    [1, 2, 1],
                    [1, 1],
                ),
            },
            (1, 0, 2),
        ),
        dataset={
            "labels": {"background": 0, "ear": [1, 2, 3], "ossicles": [2, 3], "stapes": 3},
            "regions_class_order": [1, 2, 3],
        },
    ),
    # Slice by slice, batch norm, no resampling of slices.
    "flat": dict(
        name="2d",
        folds=1,
        mirror=(0, 1),
        spacing=(2.0, 0.8, 0.8),
        shape=(4, 30, 25),
        zeros=0,
        plans=plans_of(
            "2d",
            {
                "patch_size": [24, 16],
                "spacing": [0.9, 0.7],
                "architecture": architecture(
                    "PlainConvUNet", 2, [8, 20], [[3, 3], [3, 3]], [[1, 1], [2, 2]], [2, 2], [2], "Batch"
                ),
            },
        ),
        dataset={"labels": {"background": 0, "mandible": 1, "teeth": 2}},
    ),
}

# Two stages: labels of a coarse network come into a fine one. Between slices the grid is exactly twice as fine, where
# the labels' weights tie; zeros around the image are no label at all.
_UNET = ("PlainConvUNet", 3, [6, 12], [[3, 3, 3], [3, 3, 3]], [[1, 1, 1], [2, 2, 2]], [1, 2], [1])
_COARSE = plans_of(
    "3d_lowres", {"patch_size": [8, 16, 16], "spacing": [1.6, 1.3, 1.3], "architecture": architecture(*_UNET)}
)["configurations"]["3d_lowres"]
CASCADE = dict(
    shape=(9, 22, 25),
    zeros=2,
    spacing=(1.6, 0.9, 0.9),
    mirror=(0, 1, 2),
    folds=1,
    dataset={"labels": {"background": 0, "nerve": 1, "sinus": 2, "canal": 3}},
    plans=plans_of(
        "3d_cascade_fullres",
        {
            "patch_size": [8, 16, 16],
            "spacing": [0.8, 0.75, 0.75],
            "previous_stage": "3d_lowres",
            "architecture": architecture(*_UNET),
        },
        others={"3d_lowres": dict(_COARSE, next_stage="3d_cascade_fullres")},
    ),
)

# Residual blocks, thick slices; kept as an ONNX file of each of torch's two exporters as well.
ONNX = dict(
    name="3d_fullres",
    shape=(10, 24, 21),
    zeros=0,
    spacing=(1.1, 0.7, 0.7),
    mirror=(0, 2),
    folds=1,
    dataset={"labels": {"background": 0, "nerve": 1, "sinus": 2}},
    plans=plans_of(
        "3d_fullres",
        {
            "patch_size": [8, 16, 16],
            "spacing": [1.0, 0.8, 0.8],
            "architecture": architecture(
                "ResidualEncoderUNet",
                3,
                [6, 10],
                [[1, 3, 3], [3, 3, 3]],
                [[1, 1, 1], [1, 2, 2]],
                [1, 2],
                [1],
            ),
        },
    ),
)


def image_of(shape, zeros, seed):
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, n) for n in shape], indexing="ij"))
    image = rng.normal(-700, 30, shape)
    for hu in (40, 1200, 300, 1900):
        centre, radius = rng.uniform(-0.6, 0.6, 3), rng.uniform(0.3, 0.7, 3)
        inside = (((grid - centre[:, None, None, None]) / radius[:, None, None, None]) ** 2).sum(0) < 1
        image[inside] = hu + rng.normal(0, 30, inside.sum())
    image = np.where(np.round(image) == 0, 1, np.round(image)).astype(np.int16)
    if zeros:
        image[:zeros] = 0
        image[:, :, -1] = 0
    return image


def write_nrrd(path, image, spacing):
    kind = {np.dtype(np.int16): "short", np.dtype(np.uint8): "uchar"}[image.dtype]
    x, y, z = spacing[::-1]
    head = (
        f"NRRD0004\ntype: {kind}\ndimension: 3\nspace: left-posterior-superior\n"
        f"sizes: {' '.join(map(str, image.shape[::-1]))}\n"
        f"space directions: ({x},0,0) (0,{y},0) (0,0,{z})\nkinds: domain domain domain\nendian: little\n"
        "encoding: raw\nspace origin: (0,0,0)\n\n"
    )
    path.write_bytes(head.encode() + np.ascontiguousarray(image).tobytes())


def seed_weights(network, seed, bias):
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for key, value in network.state_dict().items():
            if not value.is_floating_point():
                continue
            if key.endswith("running_var"):
                value.copy_(torch.rand(value.shape, generator=generator) + 0.5)
            elif "seg_layers" in key:
                value.copy_(torch.randn(value.shape, generator=generator) * 2 if value.ndim > 1 else bias)
            elif value.ndim > 1:
                value.copy_(torch.randn(value.shape, generator=generator) * (2.0 / value[0].numel()) ** 0.5)
            elif "norm.weight" in key:
                value.copy_(torch.rand(value.shape, generator=generator) + 0.5)
            else:
                value.copy_(torch.randn(value.shape, generator=generator) * 0.2)


def make_model(folder, case, seed, bias=None):
    plans = case["plans"]
    folder.mkdir(parents=True, exist_ok=True)
    dataset = dict(case["dataset"], channel_names={"0": "CT"}, numTraining=1, file_ending=".nrrd")
    (folder / "plans.json").write_text(json.dumps(plans, indent=1) + "\n")
    (folder / "dataset.json").write_text(json.dumps(dataset, indent=1) + "\n")
    manager = PlansManager(json.loads(json.dumps(plans)))
    configuration = manager.get_configuration(case["name"])
    heads = manager.get_label_manager(dataset).num_segmentation_heads
    network = get_network_from_plans(
        configuration.network_arch_class_name,
        configuration.network_arch_init_kwargs,
        configuration.network_arch_init_kwargs_req_import,
        determine_num_input_channels(manager, configuration, dataset),
        heads,
        deep_supervision=False,
    )
    for fold in range(case["folds"]):
        seed_weights(network, seed + fold, torch.zeros(heads) if bias is None else torch.from_numpy(bias))
        (folder / f"fold_{fold}").mkdir(exist_ok=True)
        torch.save(
            {
                "network_weights": network.state_dict(),
                "optimizer_state": {},
                "grad_scaler_state": None,
                "logging": {"mean_fg_dice": [np.float32(0.5), 0.25]},
                "_best_ema": np.float64(0.5),
                "current_epoch": 1,
                "init_args": {
                    "plans": plans,
                    "configuration": case["name"],
                    "fold": fold,
                    "dataset_json": dataset,
                    "device": torch.device("cpu"),
                },
                "trainer_name": "nnUNetTrainer",
                "inference_allowed_mirroring_axes": case["mirror"],
            },
            folder / f"fold_{fold}" / "checkpoint_final.pth",
        )


def predict(folder, image, spacing, before=None):
    predictor = nnUNetPredictor(
        tile_step_size=0.5,
        use_gaussian=True,
        use_mirroring=True,
        perform_everything_on_device=False,
        device=torch.device("cpu"),
        allow_tqdm=False,
    )
    predictor.initialize_from_trained_model_folder(str(folder), None)
    kept = []
    plain = predictor.predict_logits_from_preprocessed_data
    predictor.predict_logits_from_preprocessed_data = lambda data: kept.append(plain(data)) or kept[-1].clone()
    labels = predictor.predict_single_npy_array(
        image[None].astype(np.float32),
        {"spacing": list(spacing)},
        None if before is None else before[None].astype(np.int8),
    )
    return labels.astype(np.uint8), kept[0].numpy()


def make(folder, case, seed, image, before=None):
    make_model(folder, case, seed)
    _, logits = predict(folder, image, case["spacing"], before)
    # So that each class is somewhere.
    bias = -np.median(logits.astype(np.float32), axis=(1, 2, 3))
    make_model(folder, case, seed, bias)
    labels, logits = predict(folder, image, case["spacing"], before)
    print(folder.name, logits.shape, np.bincount(labels.ravel()).tolist(), float(np.abs(logits).max()))
    return labels, logits


def write_golden(folder, case, image, labels, logits):
    write_nrrd(folder / "image.nrrd", image, case["spacing"])
    write_nrrd(folder / "labels.nrrd", labels, case["spacing"])
    (folder / "logits.f16").write_bytes(np.ascontiguousarray(logits).astype("<f2").tobytes())


def without_traces(file):
    """The exporters write where in their own sources each node came from."""
    model = onnx.load(file, load_external_data=False)
    graph = model.graph
    for part in [model, graph, *graph.node, *graph.initializer, *graph.input, *graph.output, *graph.value_info]:
        del part.metadata_props[:]
        part.doc_string = ""
    file.write_bytes(model.SerializeToString())


def write_onnx(model, folder, newer):
    """The model's network as an ONNX file, and network.json beside it. The newer exporter keeps weights in a file beside."""
    predictor = nnUNetPredictor(device=torch.device("cpu"), perform_everything_on_device=False, allow_tqdm=False)
    predictor.initialize_from_trained_model_folder(str(model), None)
    predictor.network.load_state_dict(predictor.list_of_parameters[0])
    network = predictor.network.eval()
    configuration = predictor.configuration_manager
    folder.mkdir(parents=True, exist_ok=True)
    patch = [int(n) for n in configuration.patch_size]
    torch.onnx.export(network, (torch.zeros(1, 1, *patch),), str(folder / "network.onnx"), dynamo=newer)
    without_traces(folder / "network.onnx")
    of = CT["0"]
    description = {
        "osteotome_network": 1,
        "onnx": "network.onnx",
        "patch_size": patch,
        "spacing_mm": [float(mm) for mm in configuration.spacing],
        "normalisation": {
            "lower": of["percentile_00_5"],
            "upper": of["percentile_99_5"],
            "mean": of["mean"],
            "std": of["std"],
        },
        "labels": predictor.dataset_json["labels"],
        "mirror_axes": list(predictor.allowed_mirroring_axes),
    }
    (folder / "network.json").write_text(json.dumps(description, indent=1) + "\n")


def main():
    out = pathlib.Path(sys.argv[1])
    for number, (name, case) in enumerate(CASES.items()):
        image = image_of(case["shape"], case["zeros"], 7 + number)
        labels, logits = make(out / name, case, 100 * number + 1, image)
        write_golden(out / name, case, image, labels, logits)
    stage = "nnUNetTrainer__nnUNetPlans__"
    image = image_of(CASCADE["shape"], CASCADE["zeros"], 31)
    first, _ = make(out / "cascade" / (stage + "3d_lowres"), dict(CASCADE, name="3d_lowres"), 901, image)
    second = out / "cascade" / (stage + "3d_cascade_fullres")
    labels, logits = make(second, dict(CASCADE, name="3d_cascade_fullres"), 951, image, first)
    write_golden(second, CASCADE, image, labels, logits)
    image = image_of(ONNX["shape"], 0, 41)
    labels, logits = make(out / "onnx" / "nnunet", ONNX, 971, image)
    for name, newer in (("older", False), ("newer", True)):
        write_onnx(out / "onnx" / "nnunet", out / "onnx" / name, newer)
        write_golden(out / "onnx" / name, ONNX, image, labels, logits)
    write_onnx(out / "flat", out / "onnx" / "flat", True)


if __name__ == "__main__":
    main()
