import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image as Pillow

from farm_ar.drawing.video import write_gif, write_mp4, write_png
from farm_ar.errors import OptionError


def film(count: int = 12, height: int = 48, width: int = 64) -> list[np.ndarray]:
    """A red square that moves over a grey field."""
    frames = []
    for k in range(count):
        frame = np.full((height, width, 3), 90, np.uint8)
        frame[10:26, 2 + 3 * k : 18 + 3 * k] = 220, 30, 30
        frames.append(frame)
    return frames


def decoded(path: Path) -> list[np.ndarray]:
    video = cv2.VideoCapture(str(path))
    frames = []
    while True:
        there, frame = video.read()
        if not there:
            return frames
        frames.append(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB))


def boxes(path: Path) -> list[str]:
    """The top-level boxes of an MP4 file, in order."""
    data, names, at = path.read_bytes(), [], 0
    while at < len(data):
        names.append(data[at + 4 : at + 8].decode())
        at += int.from_bytes(data[at : at + 4], "big")
    return names


def test_a_film_decodes_to_its_frames(tmp_path: Path):
    write_mp4(tmp_path / "new" / "film.mp4", iter(film()), 30)
    frames = decoded(tmp_path / "new" / "film.mp4")
    assert len(frames) == 12
    assert frames[0].shape == (48, 64, 3)
    error = np.abs(np.array(frames, dtype=int) - np.array(film())).mean()
    assert error < 6
    video = cv2.VideoCapture(str(tmp_path / "new" / "film.mp4"))
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(30)


def test_a_film_is_what_browsers_play_and_plays_while_it_loads(tmp_path: Path):
    import imageio_ffmpeg

    write_mp4(tmp_path / "film.mp4", film(), 10)
    names = boxes(tmp_path / "film.mp4")
    assert names.index("moov") < names.index("mdat")
    told = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(tmp_path / "film.mp4")],
        capture_output=True,
        text=True,
        check=False,
    ).stderr
    assert "h264" in told
    assert "yuv420p" in told


def test_the_same_frames_give_the_same_bytes(tmp_path: Path):
    for name in ("a", "b"):
        write_mp4(tmp_path / f"{name}.mp4", film(), 30)
        write_gif(tmp_path / f"{name}.gif", film(), 10)
    for suffix in ("mp4", "gif"):
        first, second = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in ("a", "b"))
        assert first == second


def test_odd_sizes_are_padded(tmp_path: Path):
    write_mp4(tmp_path / "film.mp4", film(height=47, width=65), 30)
    frames = decoded(tmp_path / "film.mp4")
    assert len(frames) == 12
    assert frames[0].shape == (48, 66, 3)


def test_a_gif_has_its_frames_its_width_and_its_length(tmp_path: Path):
    write_gif(tmp_path / "film.gif", film(20), 15, width=32)
    with Pillow.open(tmp_path / "film.gif") as gif:
        assert gif.size == (32, 24)
        assert gif.n_frames == 20
        assert gif.info["loop"] == 0
        length = 0
        for k in range(gif.n_frames):
            gif.seek(k)
            length += gif.info["duration"]
    assert length == pytest.approx(1000 * 20 / 15, abs=10)


def test_a_gif_keeps_colours_that_are_rare(tmp_path: Path):
    rng = np.random.default_rng(0)
    frame = rng.integers(60, 110, size=(120, 160, 3)).astype(np.uint8)
    frame[5:9, 5:25] = 250, 210, 30
    write_gif(tmp_path / "film.gif", [frame], 5)
    with Pillow.open(tmp_path / "film.gif") as gif:
        assert np.asarray(gif.convert("RGB"))[7, 15] == pytest.approx([250, 210, 30], abs=12)


def test_a_png_holds_the_picture(tmp_path: Path):
    picture = film(1)[0]
    write_png(tmp_path / "one" / "picture.png", picture)
    with Pillow.open(tmp_path / "one" / "picture.png") as image:
        assert np.array_equal(np.asarray(image), picture)


@pytest.mark.parametrize("write", [write_mp4, write_gif])
def test_a_film_without_frames_is_refused(write, tmp_path: Path):
    with pytest.raises(OptionError, match="frames: must hold at least one"):
        write(tmp_path / "film", [], 10)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", [write_mp4, write_gif])
@pytest.mark.parametrize("fps", [0, -3, float("nan"), float("inf")])
def test_a_rate_that_is_no_rate_is_refused(write, fps: float, tmp_path: Path):
    with pytest.raises(OptionError, match="fps: must be"):
        write(tmp_path / "film", film(), fps)


@pytest.mark.parametrize("write", [write_mp4, write_gif])
def test_frames_of_another_size_are_refused_and_leave_nothing_behind(write, tmp_path: Path):
    target = tmp_path / "film.mp4"
    target.write_bytes(b"the old film")
    frames = [*film(3), np.zeros((50, 64, 3), np.uint8)]
    with pytest.raises(OptionError, match=r"frames: must all have the shape of the first, \(48, 64, 3\)"):
        write(target, frames, 10)
    assert target.read_bytes() == b"the old film"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("frame", [np.zeros((4, 4)), np.zeros((4, 4, 3)), np.zeros((4, 4, 4), np.uint8)])
def test_what_is_no_picture_is_refused(frame: np.ndarray, tmp_path: Path):
    with pytest.raises(OptionError, match=r"must be arrays \(H, W, 3\) of uint8"):
        write_mp4(tmp_path / "film.mp4", [frame], 10)
    with pytest.raises(OptionError, match=r"must be arrays \(H, W, 3\) of uint8"):
        write_png(tmp_path / "picture.png", frame)


def test_a_gif_of_impossible_width_or_rate_is_refused(tmp_path: Path):
    with pytest.raises(OptionError, match="width: must be a positive number of pixels, got 0"):
        write_gif(tmp_path / "film.gif", film(), 10, width=0)
    with pytest.raises(OptionError, match="fps: must be at most 50 in a GIF, got 60"):
        write_gif(tmp_path / "film.gif", film(), 60)


@pytest.mark.parametrize("colours", [1, 257])
def test_a_gif_of_an_impossible_number_of_colours_is_refused(tmp_path: Path, colours: int):
    with pytest.raises(OptionError, match="colours: must be from 2 to 256"):
        write_gif(tmp_path / "film.gif", film(), 10, colours=colours)


def test_a_gif_has_at_most_as_many_colours_as_are_asked_for(tmp_path: Path):
    ramp = np.repeat(np.arange(0, 240, 2, dtype=np.uint8)[None, :, None], 3, axis=2).repeat(16, axis=0)
    for colours in (5, 60):
        write_gif(tmp_path / "film.gif", [ramp], 10, colours=colours)
        with Pillow.open(tmp_path / "film.gif") as gif:
            shown = np.unique(np.asarray(gif.convert("RGB")).reshape(-1, 3), axis=0)
        assert colours / 2 < len(shown) <= colours


def test_what_ffmpeg_says_is_passed_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("farm_ar.drawing.video._FILTER", "nosuchfilter")
    with pytest.raises(OSError, match=r"ffmpeg failed: .*nosuchfilter"):
        write_mp4(tmp_path / "film.mp4", film(), 10)
    assert list(tmp_path.iterdir()) == []


def test_a_film_that_breaks_off_leaves_nothing_behind(tmp_path: Path):
    def frames():
        yield from film(2)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_mp4(tmp_path / "film.mp4", frames(), 10)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["film.mp4", "film.gif", "one.png"])
def test_a_full_disk_is_an_error_of_the_system_and_leaves_nothing(tmp_path: Path, name: str):
    program = (
        "import resource, sys, numpy as np\n"
        "from farm_ar.drawing.video import write_gif, write_mp4, write_png\n"
        "frames = np.random.default_rng(0).integers(256, size=(30, 120, 160, 3), dtype=np.uint8)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
        "try:\n"
        "    if sys.argv[1].endswith('.png'):\n"
        "        write_png(sys.argv[1], frames[0])\n"
        "    else:\n"
        "        (write_mp4 if sys.argv[1].endswith('4') else write_gif)(sys.argv[1], frames, 30)\n"
        "except OSError as problem:\n"
        "    print('refused', problem)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", program, name], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert result.stdout.startswith("refused")
    assert list(tmp_path.iterdir()) == []
