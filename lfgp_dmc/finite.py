"""NaN and infinity, found where they come in and before they are stored.

One of them in a replay turns all networks into NaN within a few updates.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np


class NotFiniteError(ValueError):
  """NaN or infinity where numbers are needed; the message says where."""


def is_finite(array: Any) -> bool:
  """Whether all of an array's numbers are finite as float32."""
  return bool(np.isfinite(np.asarray(array, np.float32)).all())


def fault(where: str, parts: Any) -> NotFiniteError:
  """What to raise of an array that is not finite.

  Args:
    where: it was found, for the message.
    parts: what it was made of; those that are not finite are named, if there
      are names.
  """
  named: Mapping[str, Any] = parts if isinstance(parts, Mapping) else {}
  with np.errstate(over="ignore"):  # it is what is looked for
    wrong = [name for name, part in named.items() if not is_finite(part)]
  names = f" in {', '.join(wrong)}" if wrong else ""
  return NotFiniteError(f"{where} has NaN or infinity{names}")
