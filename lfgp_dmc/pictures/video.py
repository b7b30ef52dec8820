"""Clips, pictures and film strips of frames, each with a JSON sidecar."""

import io
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

import imageio.v2 as imageio
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from lfgp_dmc.data import files

FORMATS = (".mp4", ".gif", ".webp", ".png")


def write(
  path: files.Path,
  frames: Sequence[np.ndarray],
  fps: float = 20.0,
  metadata: Mapping[str, Any] | None = None,
) -> pathlib.Path:
  """Writes frames and, beside them, `sidecar(path)`; returns the path.

  Args:
    path: `.mp4`, `.gif`, `.webp`, or `.png` (a film strip, side by side).
    frames: at least one, uint8 [height, width, 3], all of one size.
    fps: frames a second.
    metadata: for the sidecar, beside size and rate.

  Raises:
    ValueError: an unknown suffix, no frames, or frames of another kind.
  """
  path = pathlib.Path(path)
  suffix = path.suffix.lower()
  if suffix not in FORMATS:
    raise ValueError(f"{path}: unknown format; valid: {', '.join(FORMATS)}")
  frames = _checked(frames)
  height, width, _ = frames[0].shape
  path.parent.mkdir(parents=True, exist_ok=True)
  if suffix == ".mp4":
    with files.replacing(path) as aside:
      # yuv420p halves the colours' resolution: sides must be even.
      odd = ((0, height % 2), (0, width % 2), (0, 0))
      even: list[Any] = [np.pad(frame, odd, mode="edge") for frame in frames]
      imageio.mimwrite(aside, even, fps=fps, quality=8, macro_block_size=2)
      _check_whole(aside, path)
  else:  # imageio does not tell of a full disk
    picture = io.BytesIO()
    if suffix == ".png":
      imageio.imwrite(picture, np.concatenate(frames, axis=1), format="png")
    else:
      kind, each = suffix.removeprefix("."), 1000 / fps
      imageio.mimwrite(picture, frames, format=kind, duration=each, loop=0)
    files.write_bytes(path, picture.getvalue())
  size = {"frames": len(frames), "fps": fps, "width": width, "height": height}
  facts = {"file": path.name, **size, **(metadata or {})}
  files.write_json(sidecar(path), facts)
  return path


def sidecar(path: files.Path) -> pathlib.Path:
  """`clip.mp4.json` of `clip.mp4`: the name of no other file."""
  path = pathlib.Path(path)
  return path.with_name(f"{path.name}.json")


def film_strip(frames: Sequence[np.ndarray], count: int) -> list[np.ndarray]:
  """Picks `count` frames, evenly spaced from the first to the last."""
  picked = np.linspace(0, len(frames) - 1, min(count, len(frames)))
  return [frames[round(i)] for i in picked]


def grid(
  clips: Sequence[Sequence[np.ndarray]], columns: int
) -> list[np.ndarray]:
  """Plays clips side by side; the shorter ones hold their last frame.

  Frames are uint8 [height, width, 3], all of one size. The last row of clips is
  filled up with white.
  """
  blank = np.full_like(clips[0][0], 255)
  height, width, _ = blank.shape
  rows = -(-len(clips) // columns)
  frames = []
  for i in range(max(map(len, clips))):
    cells = [clip[min(i, len(clip) - 1)] for clip in clips]
    cells += [blank] * (rows * columns - len(cells))
    table = np.reshape(cells, (rows, columns, height, width, 3)).swapaxes(1, 2)
    frames.append(table.reshape(rows * height, columns * width, 3))
  return frames


def label(
  frame: np.ndarray, left: str, right: str, highlight: bool = False
) -> np.ndarray:
  """Draws captions on a dark or green (`highlight`) strip along the top.

  The frame is uint8 [height, width, 3], and is copied.
  """
  image = Image.fromarray(frame)
  size = max(10, frame.shape[0] // 20)
  font, margin = ImageFont.load_default(size), size // 2
  draw = ImageDraw.Draw(image, "RGBA")
  strip = (20, 110, 50, 190) if highlight else (0, 0, 0, 140)
  draw.rectangle((0, 0, image.width, size + 2 * margin), fill=strip)
  middle, white = margin + size / 2, (255, 255, 255, 255)
  draw.text((margin, middle), left, white, font, anchor="lm")
  draw.text((image.width - margin, middle), right, white, font, anchor="rm")
  return np.asarray(image)


def inset(frame: np.ndarray, views: Sequence[np.ndarray]) -> np.ndarray:
  """Sets views uint8 [h, w, 3] into the lower left corner of a copy.

  Side by side, each a quarter of the frame's height, pixels as they are.
  """
  frame = frame.copy()
  side = frame.shape[0] // 4
  for i, view in enumerate(views):
    square = Image.fromarray(view).resize(
      (side, side), Image.Resampling.NEAREST
    )
    frame[-side:, i * side : (i + 1) * side] = np.asarray(square)
  return frame


def _check_whole(aside: pathlib.Path, final: pathlib.Path) -> None:
  """Raises OSError if a clip ends early: FFmpeg hides a full disk."""
  try:
    imageio.get_reader(aside).close()
  except (OSError, RuntimeError, IndexError):
    raise OSError(f"{final} is not whole: is the disk full?") from None


def _checked(frames: Sequence[np.ndarray]) -> list[Any]:
  frames = [np.asarray(frame) for frame in frames]
  if not frames:
    raise ValueError("no frames to write")
  for frame in frames:
    shape, first = frame.shape, frames[0].shape
    if frame.dtype != np.uint8 or len(shape) != 3 or shape[2] != 3:
      kind = f"{frame.dtype} {list(shape)}"
      raise ValueError(f"a frame is {kind}; valid: uint8 [height, width, 3]")
    if shape != first:
      raise ValueError(f"frames of two sizes: {list(first)} and {list(shape)}")
  return frames
