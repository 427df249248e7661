import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from farm_ar.drawing import draw_scene, new_picture, save_picture, set_up_axes, widen
from farm_ar.drawing.pictures import LONGEST_SIDES, MOST_PIXELS, in_picture
from farm_ar.errors import OptionError
from farm_ar.scenes import builtin_scene


def picture() -> Figure:
    scene = builtin_scene("M2")
    figure, axes = new_picture(scene.size)
    draw_scene(axes, scene)
    return figure


def test_one_metre_is_as_long_across_as_up_the_page_and_the_room_fits() -> None:
    figure, axes = new_picture((6.0, 3.0), width_in=4.0)
    figure.draw_without_rendering()
    corner, across, up = axes.transData.transform([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    assert across[0] - corner[0] == pytest.approx(up[1] - corner[1])
    assert across[0] > corner[0]
    assert axes.get_xlim()[0] < 0.0 < 6.0 < axes.get_xlim()[1]
    assert axes.get_ylim()[0] < 0.0 < 3.0 < axes.get_ylim()[1]
    assert axes.bbox.width == pytest.approx(4.0 * figure.dpi)


def test_widening_takes_points_in_and_keeps_the_width_of_the_picture() -> None:
    figure, axes = new_picture((1.0, 1.0), width_in=4.0)
    before = axes.get_xlim()
    widen(axes, np.array([(0.5, 3.0)]), margin_m=0.1)
    figure.draw_without_rendering()
    assert axes.get_ylim()[1] == pytest.approx(3.1)
    assert axes.get_xlim() == before
    assert axes.bbox.width == pytest.approx(4.0 * figure.dpi)
    assert figure.get_figheight() > 8.0


def test_widening_never_narrows_nor_resizes_a_figure_of_several_rooms() -> None:
    figure = Figure(figsize=(6.0, 3.0))
    axes = figure.subplots(1, 2)[0]
    set_up_axes(axes, (4.0, 4.0))
    before = axes.get_xlim(), axes.get_ylim()
    widen(axes, np.array([(2.0, 2.0)]), margin_m=0.1)
    widen(axes, np.empty((0, 2)), margin_m=0.1)
    assert (axes.get_xlim(), axes.get_ylim()) == before
    assert tuple(figure.get_size_inches()) == (6.0, 3.0)


@pytest.mark.parametrize("suffix", [".svg", ".png", ".SVG"])
def test_the_same_picture_gives_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    figure = picture()
    for name, one in (("a", figure), ("b", figure), ("c", picture())):
        save_picture(one, tmp_path / f"{name}{suffix}")
    first = (tmp_path / f"a{suffix}").read_bytes()
    assert first[:5] == (b"\x89PNG\r" if suffix == ".png" else b"<?xml")
    assert first == (tmp_path / f"b{suffix}").read_bytes()
    assert first == (tmp_path / f"c{suffix}").read_bytes()
    assert mpl.__version__.encode() not in first
    assert b"<dc:date>" not in first


@pytest.mark.parametrize("name", ["scene.pdf", "scene", "svg"])
def test_another_suffix_is_refused_and_nothing_is_left(tmp_path: Path, name: str) -> None:
    with pytest.raises(OptionError, match=r"^path: must end in \.svg or \.png, got"):
        save_picture(picture(), tmp_path / "new" / name)
    assert not list(tmp_path.iterdir())


def test_a_picture_that_fails_leaves_the_older_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise OSError("no room left")

    path = tmp_path / "scene.svg"
    path.write_text("older", encoding="utf-8")
    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(OSError, match="no room left"):
        save_picture(picture(), path)
    assert path.read_text(encoding="utf-8") == "older"
    assert list(tmp_path.iterdir()) == [path]


def test_missing_folders_are_made(tmp_path: Path) -> None:
    save_picture(picture(), tmp_path / "out" / "pictures" / "scene.svg")
    assert (tmp_path / "out" / "pictures" / "scene.svg").stat().st_size > 1000


def test_drawing_never_touches_pyplot(tmp_path: Path) -> None:
    code = (
        "import sys\n"
        "from farm_ar.drawing import new_picture, save_picture\n"
        "save_picture(new_picture((1.0, 1.0))[0], sys.argv[1])\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "room.png")], check=True)


def test_an_outlier_stretches_no_picture() -> None:
    figure, axes = new_picture((5.0, 5.0))
    widen(axes, np.array([[2.0, 1600.0]]), 0.2)
    assert figure.get_figheight() == pytest.approx(LONGEST_SIDES * figure.get_figwidth())
    assert axes.get_ylim()[1] > 1600
    figure, axes = new_picture((5.0, 5.0))
    widen(axes, np.array([[-1e6, 2.0]]), 0.2)
    assert figure.get_figheight() == pytest.approx(figure.get_figwidth() / LONGEST_SIDES)


def test_a_few_strays_far_from_the_room_are_left_out_of_the_picture() -> None:
    near, far = [[1.0, 1.0], [-14.0, 2.0], [2.0, 20.0]], [[2.0, 20.5], [-16.0, 0.0]]
    assert in_picture(np.array(near + far), (4.0, 5.0)).tolist() == [True] * 3 + [False] * 2
    assert in_picture(np.array(near[:1] + far), (4.0, 5.0)).all()  # most of all: another origin, not strays
    assert in_picture(np.zeros((0, 2)), (4.0, 5.0)).shape == (0,)


@pytest.mark.parametrize("height_in", [6.0, 500.0])
def test_no_picture_has_more_pixels_than_the_most(tmp_path: Path, height_in: float) -> None:
    figure, _ = new_picture((5.0, 5.0))
    figure.set_figheight(height_in)
    save_picture(figure, tmp_path / "tall.png")
    height, width = cv2.imread(str(tmp_path / "tall.png")).shape[:2]
    assert height * width < 1.2 * MOST_PIXELS
