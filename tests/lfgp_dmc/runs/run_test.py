"""A run killed anywhere and resumed equals the run that never stopped."""

import pathlib
import shutil
from unittest import mock

import numpy as np

from lfgp_dmc import toy
from lfgp_dmc.acting import workers
from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.data.evaluation_csv import EvaluationRow
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.runs import checkpoints, run, run_folder
from lfgp_dmc.runs.schedule import TrainSchedule
from tests import fixtures

_CONFIG = {"seed": 3}


class _Killed(BaseException):
  """What `kill -9` looks like from inside."""


class _Agent(fixtures.ToyAgent):
  """Its weights follow every row it samples: any difference shows."""

  def __init__(self, replay, die_at=None):
    super().__init__()
    self._replay = replay
    self._weights = np.zeros(2, np.float32)
    self._summed = 0.0
    self._acts = 0
    self._die_at = die_at

  def act(self, observation):
    self._acts += 1
    if self._acts == self._die_at:
      raise _Killed
    noise = self.random.normal(0, 0.5, 2)
    action = np.clip(self._weights + observation + noise, -1, 1)
    return action.astype(np.float32)

  def end_episode(self, episode):
    self._weights *= np.float32(0.9) + episode.action.mean() / 10

  def update(self):
    rows = self._replay.gather(self._replay.sample_indices(self.random, 4))
    self._weights += 0.01 * rows.observation.mean(axis=0)
    self._summed += float(rows.action.sum())

  def metrics(self):
    summed, self._summed = self._summed, 0.0
    return {"loss/critic": summed, "q/right": float(self._weights[0])}

  def state_dict(self):
    return {
      "random": self.random.bit_generator.state,
      "weights": self._weights.copy(),
      "summed": self._summed,
    }

  def load_state_dict(self, state):
    self.random.bit_generator.state = state["random"]
    self._weights = state["weights"].copy()
    self._summed = state["summed"]


def _evaluate(step):
  return [EvaluationRow(step, "right", 0, 3, 1, 4, 0.5)]


class ResumingTest(fixtures.FolderTest):
  def _run(
    self, path: pathlib.Path, die_at=None, resume=False, evaluate=_evaluate
  ):
    """Trains 400 steps, or until the kill; a full ring with slack."""
    open_folder = run_folder.resume if resume else run_folder.create
    folder = open_folder(path, _CONFIG)
    replay = Replay(120, 2, 2, folder.replay, slack=100)
    made = run.Run(
      folder,
      _Agent(replay, die_at),
      toy.PointEnvironment(),
      replay,
      TrainSchedule(
        env_steps=400,
        log_every=15,
        evaluate_every=100,
        checkpoint_every=60,
        warmup_steps=30,
        updates_per_step=0.3,  # a fraction is due at checkpoints
        progress_bar=False,
      ),
      evaluate,
      _CONFIG,
      seed=3,
    )
    if resume:
      made.restore()
    made.train()

  def _killed(self, die_at: int) -> pathlib.Path:
    path = self.folder / "killed"
    with self.assertRaises(_Killed):
      self._run(path, die_at)
    return path

  def _numbers(self, path: pathlib.Path):
    rows = fixtures.rows(path / "metrics.csv")
    return rows, (path / "evaluation.csv").read_text()

  def setUp(self):
    super().setUp()
    self._run(self.folder / "whole")
    self._whole = self._numbers(self.folder / "whole")

  def test_killed_at_random_moments(self):
    random = np.random.default_rng(0)
    for number in range(5):
      path = self.folder / f"killed{number}"
      with self.assertRaises(_Killed):
        self._run(path, die_at=int(random.integers(1, 400)))
      for _ in range(2):  # may be killed again on its way
        try:
          self._run(path, die_at=int(random.integers(1, 400)), resume=True)
          break
        except _Killed:
          continue
      else:
        self._run(path, resume=True)
      self.assertEqual(self._numbers(path), self._whole)

  def test_killed_inside_a_checkpoint(self):
    path = self.folder / "killed"
    save, calls = checkpoints._write, []

    def half(aside, state):
      calls.append(aside)
      if len(calls) == 3:
        (aside / "arrays.safetensors").write_bytes(b"half")
        raise _Killed
      save(aside, state)

    with (
      mock.patch.object(checkpoints, "_write", half),
      self.assertRaises(_Killed),
    ):
      self._run(path)
    self._run(path, resume=True)
    self.assertEqual(self._numbers(path), self._whole)

  def test_killed_before_rows_or_checkpoint_reach_the_disk(self):
    for owner, name in ((Replay, "flush"), (checkpoints, "save")):
      path, real, calls = self.folder / name, getattr(owner, name), []

      def die_at_the_third(*args, real=real, calls=calls):
        calls.append(args)
        if len(calls) == 3:
          raise _Killed
        return real(*args)

      with (
        mock.patch.object(owner, name, die_at_the_third),
        self.assertRaises(_Killed),
      ):
        self._run(path)
      self._run(path, resume=True)
      self.assertEqual(self._numbers(path), self._whole)

  def test_killed_after_an_evaluation_that_was_made_up_for(self):
    path = self.folder / "killed"

    def lose(step):
      raise workers.LostWorkerError("killed")

    with self.assertRaises(workers.LostWorkerError):
      self._run(path, evaluate=lose)  # leaves a checkpoint, and a debt
    with self.assertRaises(_Killed):
      self._run(path, die_at=10, resume=True)
    self.assertLen(fixtures.rows(path / "evaluation.csv"), 1)
    self._run(path, resume=True)
    self.assertEqual(self._numbers(path), self._whole)

  def test_rows_of_other_seeds_stay_when_a_due_evaluation_is_made_up_for(self):
    path = self.folder / "killed"
    lost = workers.LostWorkerError("killed")
    with self.assertRaises(workers.LostWorkerError):
      self._run(path, evaluate=mock.Mock(side_effect=lost))
    step = int(checkpoints.every(path / "checkpoints")[-1].name)
    of_user = EvaluationRow(step, "right", 0, 909, 1, 4, 0.5)
    evaluation_csv.append_csv(path / "evaluation.csv", [of_user])
    self._run(path, resume=True)
    rows = evaluation_csv.read_csv(path / "evaluation.csv")
    self.assertLen(rows, 5)
    self.assertIn(of_user, rows)

  def test_a_damaged_newest_checkpoint_falls_back(self):
    path = self._killed(250)
    newest = checkpoints.every(path / "checkpoints")[-1]
    (newest / "state.json").write_text("{}")
    self._run(path, resume=True)
    self.assertEqual(self._numbers(path), self._whole)

  def test_a_checkpoint_of_another_version_is_named(self):
    path = self._killed(250)
    older = mock.patch.object(_Agent, "load_state_dict")
    with (
      older as load,
      self.assertRaisesRegex(ValueError, "version: it has no 'exp_avg'"),
    ):
      load.side_effect = KeyError("exp_avg")
      self._run(path, resume=True)

  def test_a_run_of_damaged_checkpoints_alone_is_left_as_it_is(self):
    path = self._killed(250)
    for checkpoint in checkpoints.every(path / "checkpoints"):
      (checkpoint / "state.json").write_text("{}")
    before = self._numbers(path)
    with self.assertRaisesRegex(ValueError, "every checkpoint .* is damaged"):
      self._run(path, resume=True)
    self.assertEqual(self._numbers(path), before)

  def test_without_its_replay_a_run_refills_it(self):
    path = self._killed(250)
    shutil.rmtree(path / "replay")
    with self.assertLogs(level="WARNING") as logs:
      self._run(path, resume=True)
    self.assertIn("refilling the replay", logs.output[0])
    rows = self._numbers(path)[0]
    self.assertEqual(rows[-1]["env_step"], "400")
    self.assertLess(int(rows[-1]["update"]), int(self._whole[0][-1]["update"]))

  def test_a_checkpoint_of_each_tenth_is_kept(self):
    found = checkpoints.every(self.folder / "whole" / "checkpoints")
    steps = [int(path.name) for path in found]
    self.assertEqual(steps, [60, 120, 180, 240, 300, 360, 400])

  def test_killed_before_the_first_checkpoint(self):
    path = self._killed(50)
    self._run(path, resume=True)
    self.assertEqual(self._numbers(path), self._whole)

  def test_a_finished_run_resumes_to_nothing(self):
    self._run(self.folder / "whole", resume=True)
    self.assertEqual(self._numbers(self.folder / "whole"), self._whole)
