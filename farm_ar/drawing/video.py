"""Films and pictures as files: H.264 that browsers play, GIF, PNG; written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import IO

import cv2
import numpy as np
import numpy.typing as npt

from farm_ar.drawing.game.colours import Image
from farm_ar.errors import OptionError
from farm_ar.scenes.files import whole_file

_FILTER = "pad=ceil(iw/2)*2:ceil(ih/2)*2"
_QUALITY = 20  # x264's constant rate factor: lower is better and larger
_GIF_SAMPLES = 8
_RARE_COLOURS = 0.4  # power of how often a colour occurs that it counts for

Frames = Iterable[npt.NDArray[np.uint8]]


def write_mp4(path: str | os.PathLike[str], frames: Frames, fps: float) -> None:
    """Write a film as H.264 in an MP4 file that plays while it loads.

    Frames are taken one by one, so there may be any number of them. The same frames give the same bytes with
    the same version of ffmpeg. An odd width or height is padded by one pixel.

    Args:
        path: the file. Folders that are missing are made.
        frames: (H, W, 3) pictures, red, green, blue, all of one size.
        fps: frames a second.

    Raises:
        OptionError: there is no frame, a frame is no such picture or of another size, or `fps` is not
            positive.
        OSError: ffmpeg fails, as on a full disk; with what it says.
    """
    import imageio_ffmpeg

    first, rest = _checked(frames, fps)
    height, width = first.shape[:2]
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-"]
    codec = [
        "-c:v",
        "libx264",
        "-preset",
        "veryfast",
        "-crf",
        str(_QUALITY),
        "-pix_fmt",
        "yuv420p",
        "-vf",
        _FILTER,
    ]
    exact = [
        "-movflags",
        "+faststart",
        "-map_metadata",
        "-1",
        "-fflags",
        "+bitexact",
        "-flags:v",
        "+bitexact",
    ]
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", *source, "-an", *codec, *exact]
    with whole_file(Path(path), ".mp4") as temporary:
        _encode([*command, "-f", "mp4", str(temporary)], chain([first], rest))


def write_gif(
    path: str | os.PathLike[str],
    frames: Frames,
    fps: float,
    width: int | None = None,
    colours: int = 192,
) -> None:
    """Write a film as a GIF that repeats, all frames with the same few colours.

    Args:
        path: the file. Folders that are missing are made.
        frames: (H, W, 3) pictures, red, green, blue, all of one size.
        fps: frames a second, at most 50; GIFs count in hundredths of a second.
        width: of the GIF, pixels, the height follows; by default that of the frames.
        colours: how many different ones, 2 to 256; fewer make a smaller file.

    Raises:
        OptionError: there is no frame, a frame is no such picture or of another size, `fps` is not positive
            or above 50, the width is not positive, or `colours` is outside 2 to 256.
    """
    from PIL import Image as Pillow

    if width is not None and width < 1:
        raise OptionError("width", "must be a positive number of pixels", width)
    if not 2 <= colours <= 256:
        raise OptionError("colours", "must be from 2 to 256", colours)
    if fps > 50:
        raise OptionError("fps", "must be at most 50 in a GIF", fps)
    first, rest = _checked(frames, fps)
    small = [_resized(frame, width) for frame in chain([first], rest)]
    step = max(1, len(small) // _GIF_SAMPLES)
    sample = Pillow.fromarray(_colour_sample(np.stack(small[::step])))
    palette = sample.quantize(colours, method=Pillow.Quantize.MEDIANCUT, kmeans=2, dither=Pillow.Dither.NONE)
    images = [Pillow.fromarray(frame).quantize(palette=palette, dither=Pillow.Dither.NONE) for frame in small]
    ends = np.rint(100 * np.arange(len(images) + 1) / fps).astype(int)
    durations = (10 * np.diff(ends)).tolist()
    with whole_file(Path(path), ".gif") as temporary:
        images[0].save(
            temporary, "GIF", save_all=True, append_images=images[1:], duration=durations, loop=0, disposal=1
        )


def write_png(path: str | os.PathLike[str], image: Image) -> None:
    """Write a picture (H, W, 3), red, green, blue, as PNG.

    Args:
        path: the file. Folders that are missing are made.
        image: the picture.

    Raises:
        OptionError: it is no such picture.
    """
    _check_frame(image, None)
    done, contents = cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    assert done
    with whole_file(Path(path), ".png") as temporary:
        temporary.write_bytes(contents.tobytes())


def _encode(command: list[str], frames: Iterable[Image]) -> None:
    """Feed frames to ffmpeg."""
    with (
        tempfile.TemporaryFile() as messages,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=messages
        ) as process,
    ):
        assert process.stdin is not None
        try:
            for frame in frames:
                process.stdin.write(np.ascontiguousarray(frame).data)
        except BrokenPipeError:
            pass  # ffmpeg has given up, and says why
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
        if process.wait():
            said = _tail(messages).replace("\n", " ") or f"it ended with code {process.returncode}"
            raise OSError(errno.EIO, f"ffmpeg failed: {said}")


def _tail(messages: IO[bytes]) -> str:
    messages.seek(0)
    return messages.read().decode(errors="replace").strip()[-500:]


def _checked(frames: Frames, fps: float) -> tuple[Image, Iterator[Image]]:
    """The first frame and the others, each checked when it comes."""
    if not 0 < fps < np.inf:
        raise OptionError("fps", "must be a positive number of frames a second", fps)
    given = iter(frames)
    first = next(given, None)
    if first is None:
        raise OptionError("frames", "must hold at least one", 0)
    _check_frame(first, None)
    shape = first.shape

    def others() -> Iterator[Image]:
        for frame in given:
            _check_frame(frame, shape)
            yield frame

    return first, others()


def _check_frame(frame: Image, shape: tuple[int, ...] | None) -> None:
    array = np.asarray(frame)
    if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise OptionError("frames", "must be arrays (H, W, 3) of uint8", (array.shape, str(array.dtype)))
    if shape is not None and array.shape != shape:
        raise OptionError("frames", f"must all have the shape of the first, {shape}", array.shape)


def _colour_sample(frames: Image) -> Image:
    """A picture with the colours of frames (F, H, W, 3), rare ones far above their share: words are rare."""
    coarse = (frames >> 2).reshape(-1, 3).astype(np.int64)
    code, count = np.unique(coarse @ np.array([1 << 12, 1 << 6, 1]), return_counts=True)
    colours = np.stack([code >> 12, (code >> 6) & 63, code & 63], axis=1) * 4 + 2
    often = np.ceil(count**_RARE_COLOURS).astype(int)
    return np.repeat(colours, often, axis=0).astype(np.uint8)[None]


def _resized(frame: Image, width: int | None) -> Image:
    if width is None or width == frame.shape[1]:
        return np.array(frame)
    height = max(1, round(frame.shape[0] * width / frame.shape[1]))
    shrunk = cv2.resize(frame, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(shrunk, dtype=np.uint8)
