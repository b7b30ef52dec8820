"""Runs of a sweep that start from what others of it learned."""

from collections.abc import Sequence, Set

from lfgp_dmc.launch.sweeps import progress
from lfgp_dmc.launch.sweeps.jobs import HELD, WAITING, Job


def chain(
  jobs: Sequence[Job], starts: Sequence[str], done: Set[str] = frozenset()
) -> None:
  """Says which runs start from which, by `TARGET:SOURCE:FIELD`.

  Such as `lfgp_transfer_stack:lfgp_move_object:config.transfer_from`: that
  run of a seed waits for the source's of the same seed, and gets its folder as
  that field. Sources that are no jobs are done by their evaluation, or named in
  `done`. Targets that are none are left alone: a sweep may be a part of
  another.

  Raises:
    ValueError: not of that form.
  """
  known = {job.name for job in jobs} | done
  bare = {job.flagfile.stem for job in jobs}
  for start in starts:
    parts = start.split(":")
    if len(parts) != 3 or not all(parts):
      raise ValueError(f"{start!r}; valid: TARGET:SOURCE:config.FIELD")
    target, source, field = parts
    if target in bare:
      raise ValueError(
        f"{start!r}; valid: a TARGET with its task, such as lfgp_stack"
      )
    for job in jobs:
      if job.name != f"{target}_{job.seed}":
        continue
      job.after = f"{source}_{job.seed}"
      folder = job.folder.with_name(job.after)
      job.arguments = (*job.arguments, f"--{field}={folder}")
      is_there = job.after in known or progress.is_done(folder)
      if job.state == WAITING and not is_there:
        job.state, job.message = HELD, f"{job.after} is not part of the sweep"
