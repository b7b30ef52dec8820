"""The encoder: what it sees, and that it learns from what it sees alone."""

import dataclasses
from unittest import mock

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import bc, serialisation, vision
from lfgp_dmc.agents.bc import pixel_pairs
from lfgp_dmc.agents.bc.pixel_pairs import PixelPairs
from lfgp_dmc.agents.networks import encoder as encoders
from lfgp_dmc.agents.networks.encoder import Encoder
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.agents.vision import EncoderConfig
from tests import fixtures
from tests.agents.fixtures import parts

_SHAPE = (2, 32, 32, 3)


def _encoder(channels: int = 4) -> Encoder:
  return Encoder(_SHAPE, 6, channels, torch.Generator().manual_seed(0))


def _encode(encoder: Encoder, frames: np.ndarray) -> np.ndarray:
  arrays = {
    f"encoder.{name}": array
    for name, array in serialisation.module_state(encoder).items()
  }
  return vision.encode(arrays.__getitem__, frames)


def _dots(places) -> np.ndarray:
  """Frames of two cameras that see a bright dot at (row, column)."""
  frames = np.zeros((len(places), *_SHAPE), np.uint8)
  for frame, (row, column) in zip(frames, places, strict=True):
    frame[:, row : row + 3, column : column + 3] = 255
  return frames


class EncoderTest(parameterized.TestCase):
  def test_features_are_bounded_and_follow_the_frames(self):
    frames = _dots([(4, 4), (4, 24), (24, 4), (4, 4)])
    features = _encode(_encoder(), frames)
    self.assertEqual((features.shape, features.dtype), ((4, 6), np.float32))
    self.assertLessEqual(np.abs(features).max(), 1)
    np.testing.assert_array_equal(features[0], features[3])
    self.assertGreater(np.abs(features[0] - features[1]).max(), 0.01)
    self.assertGreater(np.abs(features[0] - features[2]).max(), 0.01)

  def test_numpy_and_torch_make_the_same_features(self):
    encoder = _encoder(8)
    for parameter in encoder.parameters():
      torch.nn.init.normal_(parameter, std=0.5)
    frames = np.random.default_rng(0).integers(
      256, size=(33, *_SHAPE), dtype=np.uint8
    )
    with torch.inference_mode():
      theirs = encoder(torch.from_numpy(frames).float()).numpy()
    ours = _encode(encoder, frames)
    self.assertEqual(ours.dtype, np.float32)
    np.testing.assert_allclose(ours, theirs, atol=1e-4)
    np.testing.assert_array_equal(
      _encode(encoder, frames[:17])[16:], ours[16:17]
    )
    shapes = vision.shapes(_SHAPE, 6, 8)
    own = {
      f"encoder.{k}": tuple(v.shape) for k, v in encoder.state_dict().items()
    }
    self.assertEqual(shapes, own)

  def test_too_small_frames_are_refused(self):
    with self.assertRaisesRegex(ValueError, "sides of 32 pixels or more"):
      Encoder((1, 31, 40, 3), 6, 4, torch.Generator())

  def test_shifts_move_every_frame_by_some_pixels_and_repeat_edges(self):
    frames = np.zeros((50, *_SHAPE), np.uint8)
    frames[:, :, 10, 10] = 255
    frames[:, :, 0] = 7  # the upper edge
    moved = encoders.shifted(frames, 2, np.random.default_rng(0))
    n, camera, row, column, _ = np.nonzero(moved == 255)
    self.assertLen(n, 50 * 2 * 3)
    self.assertEqual(set(row), {8, 9, 10, 11, 12})
    self.assertEqual(set(column), {8, 9, 10, 11, 12})
    differs = [set(row[(n == i) & (camera == 0)]) for i in range(50)]
    self.assertNotEqual(
      differs, [set(row[(n == i) & (camera == 1)]) for i in range(50)]
    )
    deepest = (moved == 7).all((3, 4)).sum(-1).max()
    self.assertEqual(deepest, 3)

  def test_no_shift_is_the_frames_themselves(self):
    frames = _dots([(1, 1)])
    self.assertIs(encoders.shifted(frames, 0, np.random.default_rng(0)), frames)


class PixelPairsTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    lengths = {"a": (10, 20), "b": (5, 15)}
    self.shown = {
      task: fixtures.with_frames(fixtures.demonstrations(*of_task), 32)
      for task, of_task in lengths.items()
    }
    self.shown["b"].frames[:] = 255 - self.shown["b"].frames  # other frames
    self.encoder = _encoder()
    self.pairs = PixelPairs(
      self.shown, ("a", "b"), Standardiser(5 + 6), 0.5,
      np.random.default_rng(0), self.encoder, 4, torch.float32,
    )  # fmt: skip

  def _check(self, inputs, task, rows):
    data = self.shown[task]
    frames = torch.from_numpy(data.frames[data.frame_rows()[rows]]).float()
    expected = [torch.from_numpy(data.observation[rows]), self.encoder(frames)]
    torch.testing.assert_close(inputs, torch.cat(expected, dim=1))

  def test_a_row_has_the_features_of_its_own_frame(self):
    batch = self.pairs.batch(torch.tensor([[0, 15, 29], [30, 36, 49]]))
    self._check(batch.inputs[0], "a", [0, 15, 29])
    self._check(batch.inputs[1], "b", [0, 6, 19])

  def test_validation_is_of_all_its_rows_and_shifts_none(self):
    self.enter_context(mock.patch.object(pixel_pairs, "_ROWS", 4))
    (inputs,), (action,) = self.pairs.validation(1)
    rows = self.pairs.validation_rows[1] - 30
    self.assertLen(rows, 10)
    self._check(inputs, "b", rows)
    np.testing.assert_array_equal(action, self.shown["b"].action[rows])

  def test_training_shifts_by_the_pixels_of_the_config(self):
    config = bc.BcConfig(batch_size=8, encoder=EncoderConfig(shift=3))
    sizes = 5, 2
    agent = bc.build(
      config, parts(("a",), self.shown, sizes=sizes, frame_shape=_SHAPE)
    )
    agent.begin_epoch()
    with mock.patch.object(
      encoders, "shifted", side_effect=encoders.shifted
    ) as shifted:
      agent.update()
      agent.end_epoch()
    (call,) = shifted.mock_calls  # of the batch, and none of validation
    self.assertEqual(call.args[1], 3)


class CloningTest(absltest.TestCase):
  def _loss(self, is_blind: bool) -> float:
    """After some epochs on pairs whose action is where the dot is."""
    data = fixtures.demonstrations(40)
    random = np.random.default_rng(3)
    places = random.integers(29, size=(41, 2))
    frames = np.zeros_like(_dots(places)) if is_blind else _dots(places)
    data = dataclasses.replace(
      data,
      observation=np.zeros_like(data.observation),
      action=(places[:40] / 14 - 1).astype(np.float32),
      frames=frames,
    )
    config = bc.BcConfig(
      batch_size=14,
      learning_rate=3e-3,
      encoder=EncoderConfig(channels=8, shift=0),
    )
    sizes = 5, 2
    agent = bc.build(
      config, parts(("t",), {"t": data}, sizes=sizes, frame_shape=_SHAPE)
    )
    for _ in range(60):
      for _ in range(agent.begin_epoch()):
        agent.update()
      agent.end_epoch()
    return agent.metrics()["loss/train"]

  def test_frames_are_learned_from_and_constant_ones_teach_nothing(self):
    seeing, blind = self._loss(False), self._loss(True)
    self.assertGreater(blind, 0.15)
    self.assertLess(seeing, 0.5 * blind)


if __name__ == "__main__":
  absltest.main()
