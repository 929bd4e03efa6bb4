"""Dice of nnunetv2's own prediction against the truth, by structure."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch
import torch.nn.functional as F
from nnunetv2.inference.predict_from_raw_data import nnUNetPredictor
from nnunetv2.preprocessing.preprocessors.default_preprocessor import DefaultPreprocessor


def predictor_of(folder, device):
    predictor = nnUNetPredictor(
        tile_step_size=0.5,
        use_gaussian=True,
        use_mirroring=True,
        perform_everything_on_device=device.type == "cuda",
        device=device,
        allow_tqdm=False,
    )
    predictor.initialize_from_trained_model_folder(str(folder), None)
    return predictor


def prepare(predictor, image, spacing):
    """The image as the network sees it, and where it lay."""
    data, _, properties = DefaultPreprocessor(verbose=False).run_case_npy(
        image[None],
        None,
        {"spacing": spacing},
        predictor.plans_manager,
        predictor.configuration_manager,
        predictor.dataset_json,
    )
    return torch.from_numpy(data), properties


def labels_of(predictor, data, properties):
    """Logits on the network's grid, labels on the image's. torch interpolates the logits: nnU-Net's order 1, but for seconds less."""
    logits = predictor.predict_logits_from_preprocessed_data(data).float().to(predictor.device)
    return logits, labels_on_image(logits, properties)


def labels_on_image(logits, properties):
    size = [int(n) for n in properties["shape_after_cropping_and_before_resampling"]]
    cropped = F.interpolate(logits[None], size=size, mode="trilinear", align_corners=False)[0].argmax(0)
    labels = np.zeros(properties["shape_before_cropping"], np.uint8)
    labels[tuple(slice(*box) for box in properties["bbox_used_for_cropping"])] = cropped.cpu().numpy()
    return labels


def dice(found, truth):
    total = int(found.sum()) + int(truth.sum())
    return 2 * int((found & truth).sum()) / total if total else 1.0


def score_cases(folder, cases, dataset, device, threads):
    """{name of the structure: {name of the case: Dice}} of cases (name, image, truth, spacing)"""
    predictor = predictor_of(folder, device)
    scores = {name: {} for name, value in dataset["labels"].items() if value}
    with ThreadPoolExecutor(threads) as pool:
        prepared = pool.map(lambda case: prepare(predictor, case[1], case[3]), cases)
        for (case, _, truth, _), (data, properties) in zip(cases, prepared):
            _, labels = labels_of(predictor, data, properties)
            for name, of in scores.items():
                value = dataset["labels"][name]
                of[case] = dice(labels == value, truth == value)
            print(case, " ".join(f"{name} {of[case]:.2f}" for name, of in scores.items()), flush=True)
    return scores
