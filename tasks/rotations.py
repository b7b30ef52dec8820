"""Rotations: of a cube, modulo its 24 symmetries, and of cameras."""

import itertools

import numpy as np


def _cube_rotations() -> np.ndarray:
  """The cube's 24 rotations as unit quaternions w x y z, float [24, 4].

  The binary octahedral group up to sign: the axes of the quaternions, sums of
  two axes and sums of all four, normalised.
  """
  found: list[tuple[float, ...]] = []
  for count in (1, 2, 4):
    for axes in itertools.combinations(range(4), count):
      for signs in itertools.product((1.0, -1.0), repeat=count - 1):
        quat = np.zeros(4)
        quat[list(axes)] = (1.0, *signs)
        found.append(tuple(quat / np.linalg.norm(quat)))
  return np.array(found)


def _right_matrix(quat) -> np.ndarray:
  """R with R p = p * quat (Hamilton product), float [4, 4]."""
  w, x, y, z = quat
  return np.array(
    [[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]]
  )


# [24, 4, 4]: these map a quaternion to all of its equivalents.
_SYMMETRIES = np.stack([_right_matrix(quat) for quat in _cube_rotations()])
_TO_COSINES = np.ascontiguousarray(_SYMMETRIES[:, 0].T)  # [4, 24]


def reduce_rotation(quat: np.ndarray) -> np.ndarray:
  """The equivalent rotations of a cube with the smallest angles.

  Unit quaternions w x y z, float [..., 4], w > 0 in the result; among ties the
  cube rotation of the lowest index.
  """
  cosines = np.abs(quat @ _TO_COSINES)
  # Rounded, so that the last bit decides no tie.
  best = _SYMMETRIES[np.argmax(cosines.round(9), axis=-1)]
  reduced = (best @ quat[..., None])[..., 0]
  return np.where(reduced[..., :1] < 0, -reduced, reduced)


def look_at(eye, target, up=(0.0, 0.0, 1.0)) -> np.ndarray:
  """A camera's x and y axes when it looks from `eye` at `target`, float [6]."""
  backwards = np.subtract(eye, target)
  right = np.cross(up, backwards)
  above = np.cross(backwards, right)
  return np.concatenate(
    [right / np.linalg.norm(right), above / np.linalg.norm(above)]
  )
