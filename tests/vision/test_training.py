"""Training: what a sample teaches can be read back, the loop learns and goes on, ONNX does as torch does."""

import json
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="pip install '.[vision]'")
pytest.importorskip("onnx", reason="pip install '.[vision]'")

from farm_ar.errors import OptionError  # noqa: E402
from farm_ar.geometry import wrap  # noqa: E402
from farm_ar.rendering.shapes import box, mesh_of  # noqa: E402
from farm_ar.vision import heads  # noqa: E402
from farm_ar.vision.network import PoseNetwork  # noqa: E402
from farm_ar.vision.scoring import farm_meshes  # noqa: E402
from farm_ar.vision.training.samples import Samples  # noqa: E402
from farm_ar.vision.training.targets import losses_of, targets_of  # noqa: E402
from farm_ar.vision.training.training import Training, train  # noqa: E402

TINY = Training(images=32, block=16, reuse=1, batch=8, kept=2)


@pytest.fixture(scope="module")
def samples():
    made = Samples(farm_meshes(), seed=3)
    return [made[number] for number in range(12)]


def perfect(sample):
    """The output of a network that has learnt a sample by heart."""
    _, heat, _, values, _, share = targets_of([sample], 3)
    logit = torch.logit(heat.clamp(1e-4, 0.99))
    spread = torch.zeros(1, 2, *heat.shape[2:])
    return torch.cat([logit, values, spread, share[:, None]], dim=1)


def test_what_a_sample_teaches_is_what_is_read_from_a_perfect_output(samples):
    number = 0
    for sample in samples:
        found = heads.read(perfect(sample)[0].numpy(), least=0.5)
        wanted = sample.things[sample.things[:, 6] >= 0.3]
        for category, _, _, foot_u, foot_v, yaw, visible, _ in wanted.tolist():
            away = np.linalg.norm(found.foot - [foot_u, foot_v], axis=1)
            away[found.category != category] = np.inf
            k = int(away.argmin())
            if away[k] > 0.2:  # another of its kind stands in the same cells
                continue
            number += 1
            assert abs(wrap(found.heading[k] - yaw)) < 0.1
            assert found.visible[k] == pytest.approx(visible, abs=0.1)
            assert found.flipped[k] < 0.01
    assert number > 0.8 * sum((sample.things[:, 6] >= 0.3).sum() for sample in samples)


def test_the_loss_is_least_for_a_perfect_output(samples):
    right = perfect(samples[0])
    targets = targets_of(samples[:1], 3)
    least = losses_of(right, targets)
    rng = torch.Generator().manual_seed(0)
    worse = losses_of(right + torch.randn(right.shape, generator=rng), targets)
    assert least["heat"] < 0.5 * worse["heat"]
    for name in ("foot", "heading", "visible"):
        assert least[name] < 0.2 * worse[name] + 1e-3


def test_a_mean_of_opposite_headings_tells_how_probable_the_other_is():
    output = np.zeros((1 + heads.REGRESSED, 8, 8), np.float32)
    output[0] = -9
    output[0, 4, 4] = 4
    yaw, flipped = 0.7, 0.2
    once = (1 - 2 * flipped) * np.array([np.sin(yaw), np.cos(yaw)])
    output[1 + heads.HEADING.start : 1 + heads.HEADING.stop] = once[:, None, None]
    twice = np.array([np.sin(2 * yaw), np.cos(2 * yaw)])
    output[1 + heads.AXIS.start : 1 + heads.AXIS.stop] = twice[:, None, None]
    found = heads.read(output)
    assert found.heading[0] == pytest.approx(yaw, abs=1e-6)
    assert found.flipped[0] == pytest.approx(flipped, abs=1e-6)


def test_samples_repeat_and_differ(samples):
    again = Samples(farm_meshes(), seed=3)[5]
    np.testing.assert_array_equal(again.image, samples[5].image)
    np.testing.assert_array_equal(again.things, samples[5].things)
    assert not np.array_equal(samples[4].image, samples[5].image)
    visible = np.concatenate([sample.things[:, 6] for sample in samples])
    assert (visible > 0.9).any()
    assert ((visible > 0.05) & (visible < 0.7)).any()


def test_the_loop_trains_writes_and_goes_on(tmp_path):
    out = tmp_path / "boxes.onnx"
    meshes = {
        "brick": mesh_of(box((-0.1, 0, -0.05), (0.1, 0.05, 0.05), (200, 90, 60))),
        "cube": mesh_of(box((-0.05, 0, -0.05), (0.05, 0.1, 0.05), (90, 90, 200))),
    }
    said = []
    network = train(meshes, out, TINY, lambda what, share: said.append((what, share)))
    assert [share for _, share in said] == [0.5, 1.0]
    assert "32 images" in said[-1][0]
    assert out.stat().st_size < 3_000_000
    read = PoseNetwork(out)
    assert read.names == ("brick", "cube")
    np.testing.assert_allclose(read.sizes["brick"], [0.2, 0.05, 0.1])
    image = np.random.default_rng(0).integers(0, 256, (192, 320, 3), np.uint8)
    with torch.no_grad():
        wanted = network(torch.from_numpy(image.transpose(2, 0, 1)[None].astype(np.float32) / 255))[0].numpy()
    np.testing.assert_allclose(read(image), wanted, atol=2e-3)

    more = replace(TINY, images=48)
    train(meshes, out, more, lambda what, share: said.append((what, share)), resume=True)
    assert [share for _, share in said[2:]] == [1.0]
    with pytest.raises(OptionError, match="must be those of the checkpoint"):
        train({"ball": meshes["cube"]}, out, more, resume=True)
    with pytest.raises(OptionError, match=r"must end in \.onnx"):
        train(meshes, tmp_path / "boxes.bin", TINY)


def test_a_file_that_is_no_network_is_refused(tmp_path):
    for content, words in ((None, "must be a file"), (b"nonsense", "must be of a network")):
        path = tmp_path / "bad.onnx"
        if content is not None:
            path.write_bytes(content)
            path.with_suffix(".json").write_text(json.dumps({"categories": {"coop": [1, 1, 1]}}))
        with pytest.raises(OptionError, match=words):
            PoseNetwork(path)
