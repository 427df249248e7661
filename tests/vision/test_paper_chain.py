"""The paper's chain of SAM, CLIP and silhouettes: each link alone, and all of it with tiny random weights."""

import numpy as np
import pytest

from farm_ar.errors import OptionError
from farm_ar.geometry import wrap
from farm_ar.rendering import HOLOLENS_2, Instance, Renderer, View, model
from farm_ar.scenes import Detections

torch = pytest.importorskip("torch")

from farm_ar.vision.paper_chain import ChainOptions, PaperEstimator, fit_silhouette, suppress  # noqa: E402

CAMERA = View(HOLOLENS_2.resized(320, 180), np.array([0.0, 0.45, -0.4]), 0.0, -0.8)
MESHES = {name: model(name) for name in ("coop", "hutch")}


def drawn(category, pose):
    x, z, yaw = pose
    return Renderer([Instance(MESHES[category], np.array([x, 0.0, z]), yaw, 1)]).draw(CAMERA)


@pytest.mark.parametrize(
    ("category", "pose"),
    [("coop", (0.02, 0.05, 0.6)), pytest.param("hutch", (-0.1, 0.1, -2.0), marks=pytest.mark.long)],
)
def test_a_silhouette_is_fitted_to_millimetres(category, pose):
    mask = drawn(category, pose).ids == 1
    found = fit_silhouette(mask, CAMERA, MESHES[category], ChainOptions())
    assert np.linalg.norm(found[:2] - pose[:2]) < 0.006
    off = abs(wrap(found[2] - pose[2]))  # a silhouette hardly tells front from back
    assert min(off, np.pi - off) < 0.35


def test_masks_of_the_sky_and_of_a_few_pixels_have_no_place():
    sky = View(CAMERA.intrinsics, CAMERA.eye, 0.0, 1.2)
    mask = np.zeros((180, 320), bool)
    mask[20:60, 100:150] = True
    assert fit_silhouette(mask, sky, MESHES["coop"], ChainOptions()) is None
    mask[:] = False
    mask[90, 100:110] = True
    assert fit_silhouette(mask, CAMERA, MESHES["coop"], ChainOptions()) is None


def test_of_masks_with_about_the_same_box_the_better_one_stays():
    first, nearly, apart, nothing = (np.zeros((40, 60), bool) for _ in range(4))
    first[10:30, 10:30] = nearly[10:30, 12:30] = apart[10:30, 40:55] = True
    kept = suppress([(0.9, first), (0.95, nearly), (0.5, apart), (1.0, nothing)], 0.7)
    assert len(kept) == 2
    assert kept[0] is nearly
    assert kept[1] is apart
    assert len(suppress([(0.9, first), (0.95, nearly)], 0.95)) == 2


def test_without_weights_one_line_says_which_files_are_wanted(tmp_path, monkeypatch):
    pytest.importorskip("transformers")
    monkeypatch.delenv("FARM_AR_SAM", raising=False)
    for folder in (None, tmp_path, tmp_path / "none"):
        with pytest.raises(
            OptionError, match=r"sam.*config\.json and model\.safetensors of SAM.*FARM_AR_SAM"
        ):
            PaperEstimator(folder, tmp_path)


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    transformers = pytest.importorskip("transformers")
    folder = tmp_path_factory.mktemp("weights")
    torch.manual_seed(0)
    vision = transformers.SamVisionConfig(
        hidden_size=16, num_hidden_layers=1, num_attention_heads=2, image_size=64, patch_size=8,
        output_channels=8, num_pos_feats=4, mlp_dim=16, global_attn_indexes=[0], window_size=4,
    )  # fmt: skip
    prompt = transformers.SamPromptEncoderConfig(
        hidden_size=8, image_size=64, patch_size=8, mask_input_channels=4
    )
    decoder = transformers.SamMaskDecoderConfig(
        hidden_size=8, mlp_dim=8, num_hidden_layers=1, num_attention_heads=2, iou_head_hidden_dim=8
    )
    sam = transformers.SamModel(
        transformers.SamConfig(
            vision_config=vision, prompt_encoder_config=prompt, mask_decoder_config=decoder
        )
    )
    small = {"hidden_size": 16, "intermediate_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2}
    clip = transformers.CLIPModel(
        transformers.CLIPConfig(
            text_config={**small, "vocab_size": 20, "projection_dim": 8},
            vision_config={**small, "image_size": 32, "patch_size": 8, "projection_dim": 8},
            projection_dim=8,
        )
    )
    sam.save_pretrained(folder / "sam")
    clip.save_pretrained(folder / "clip")
    return folder


def test_the_whole_chain_runs_from_an_image_to_detections(weights):
    options = ChainOptions(points=4, least_iou=-1e9, alike=-1.0, yaws=1, steps=2)
    estimator = PaperEstimator(weights / "sam", weights / "clip", options)
    image = drawn("coop", (0.0, 0.05, 0.3)).rgb
    masks = estimator.masks(image)
    assert masks
    assert all(mask.shape == (180, 320) and mask.dtype == bool for mask in masks)
    found = estimator.estimate(image, CAMERA, MESHES)
    assert isinstance(found.detections, Detections)
    assert set(found.detections.category) <= set(MESHES)
    again = estimator.estimate(image, CAMERA, MESHES)
    np.testing.assert_array_equal(found.detections.position, again.detections.position)


def test_what_looks_like_no_mesh_is_left_out_and_what_is_one_is_most_like_itself(weights):
    estimator = PaperEstimator(weights / "sam", weights / "clip", ChainOptions(alike=1.01))
    picture = drawn("coop", (0.0, 0.05, 0.3))
    name, alike = estimator.category(picture.rgb, picture.ids == 1, MESHES)
    assert name == ""
    assert -1 <= alike <= 1
    estimator = PaperEstimator(weights / "sam", weights / "clip", ChainOptions(alike=-1.0))
    alone = Renderer([Instance(MESHES["hutch"], np.zeros(3), 0.0, 1)])
    view = View(HOLOLENS_2.resized(96, 54), np.array([0.0, 0.2, -0.3]), 0.0, -0.58)
    picture = alone.draw(view)
    name, _ = estimator.category(picture.rgb, picture.ids == 1, {"hutch": MESHES["hutch"]})
    assert name == "hutch"
