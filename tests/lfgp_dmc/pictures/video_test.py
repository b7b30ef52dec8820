"""Videos are files that other programs read."""

import json

import imageio.v2 as imageio
import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc.pictures import film_strips, video
from lfgp_dmc.pictures.recorder import Clip, Look
from tests.fixtures import FolderTest, full_disk


def _frames(count=8, height=47, width=63):
  frames = np.zeros((count, height, width, 3), np.uint8)
  for i, frame in enumerate(frames):
    frame[:, i * 5 : i * 5 + 9] = (250, 80, 20)
  return list(frames)


class VideoTest(FolderTest):
  @parameterized.parameters("clip.mp4", "clip.gif", "clip.webp")
  def test_clip_plays_back(self, name):
    path = video.write(self.folder / "new" / name, _frames(), 20, {"seed": 3})
    read = imageio.mimread(path)
    self.assertLen(read, 8)
    self.assertLess(np.abs(read[4][20, 24, :3] - [250.0, 80, 20]).max(), 60)
    sidecar = json.loads((path.parent / f"{name}.json").read_text())
    self.assertEqual((sidecar["frames"], sidecar["seed"]), (8, 3))
    self.assertLen(list(path.parent.iterdir()), 2)

  def test_nothing_else_is_overwritten(self):
    config = self.folder / "config.json"
    config.write_text("kept")
    for name in ("config.png", "config.gif"):
      video.write(self.folder / name, _frames(2))
    self.assertEqual(config.read_text(), "kept")
    self.assertLen(list(self.folder.iterdir()), 5)

  @parameterized.parameters("a.mp4", "a.gif", "a.png")
  def test_a_full_disk_leaves_no_torn_clip(self, name):
    noise = np.random.default_rng(0).integers(0, 255, (9, 160, 160, 3))
    with full_disk(), self.assertRaisesRegex(OSError, name):
      video.write(self.folder / name, noise.astype(np.uint8))
    self.assertEmpty(list(self.folder.iterdir()))

  def test_a_strip_of_frames(self):
    frames = video.film_strip(_frames(), 3)
    path = video.write(self.folder / "strip.png", frames)
    self.assertEqual(imageio.imread(path).shape, (47, 3 * 63, 3))

  def test_a_grid_of_clips(self):
    long, short = _frames(8, 20, 30), _frames(3, 20, 30)
    frames = video.grid([long, short, short], columns=2)
    self.assertLen(frames, 8)
    self.assertEqual(frames[0].shape, (40, 60, 3))
    np.testing.assert_array_equal(frames[7][:20, :30], long[7])
    np.testing.assert_array_equal(frames[7][:20, 30:], short[2])
    self.assertTrue((frames[0][20:, 30:] == 255).all())

  def test_a_label_is_drawn_on_a_copy(self):
    frame = np.full((240, 320, 3), 200, np.uint8)
    labelled = video.label(frame, "reach", "step 12", highlight=True)
    self.assertEqual(labelled.shape, frame.shape)
    self.assertTrue((frame == 200).all())
    self.assertTrue((labelled[60:] == 200).all())
    self.assertGreater((labelled[:20] > 180).all(axis=-1).sum(), 50)

  def test_bad_input_is_named(self):
    frames = _frames()
    for name, bad, message in (
      ("a.avi", frames, "valid: .mp4, .gif, .webp, .png"),
      ("a.mp4", [], "no frames"),
      ("a.mp4", [frames[0] / 255.0], "float64"),
      ("a.mp4", [frames[0], frames[0][1:]], "two sizes"),
    ):
      with self.assertRaisesRegex(ValueError, message):
        video.write(self.folder / name, bad)
    self.assertEmpty(list(self.folder.iterdir()))


class FilmStripTest(absltest.TestCase):
  def test_shows_the_first_success_from_the_reset_on(self):
    def play(seed, look, max_steps=40, until_success_of=None):
      success = {"lift": 12} if seed == 7 else {}
      frames = list(range(2 * max_steps + 1)) if look.every else []
      return Clip(frames, [], success, max_steps, checks=2)

    found = film_strips.row(play, "lift", range(5, 9), Look(), 4)
    self.assertEqual(found, ([0, 8, 16, 24], 7, 12))
    with self.assertRaisesRegex(ValueError, "no success of lift in 2 episodes"):
      film_strips.row(play, "lift", range(2), Look(), 4)
