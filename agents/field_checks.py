"""What a config's fields may hold, told in one line each."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any


def is_integer(value: Any) -> bool:
  """Whether it is an int, and no bool."""
  return isinstance(value, int) and not isinstance(value, bool)


def is_number(value: Any) -> bool:
  """Whether it is a finite int or float, and no bool."""
  is_real = isinstance(value, int | float) and not isinstance(value, bool)
  return is_real and abs(value) < float("inf")  # false for NaN


def positions(slices: str) -> tuple[int, ...]:
  """The numbers of floats that slices such as "3:6,53:59" name.

  Raises:
    ValueError: something else than START:STOP, with commas between.
  """
  found: list[int] = []
  for part in filter(None, slices.split(",")):
    start, stop = map(int, part.split(":"))
    if not 0 <= start < stop:
      raise ValueError(f"{part} names no floats")
    found += range(start, stop)
  return tuple(found)


def are_slices(value: Any) -> bool:
  """Whether `positions` takes it."""
  try:
    positions(value)
  except (ValueError, AttributeError):
    return False
  return True


# What is valid, as messages say it -> its test.
TESTS: dict[str, Callable[[Any], bool]] = {
  "an integer above 0": lambda value: is_integer(value) and value > 0,
  "an integer, 0 or more": lambda value: is_integer(value) and value >= 0,
  "a number above 0": lambda value: is_number(value) and value > 0,
  "a number, 0 or more": lambda value: is_number(value) and value >= 0,
  "a number": is_number,
  "a number from 0 to 1": lambda value: is_number(value) and 0 <= value <= 1,
  "a number above 0, at most 1": lambda value: (
    is_number(value) and 0 < value <= 1
  ),
  "a number above 0, below 1": lambda value: is_number(value) and 0 < value < 1,
  "a folder's name, or nothing": lambda value: isinstance(value, str),
  "slices of an observation, such as 3:6,53:59": are_slices,
  "True or False": lambda value: isinstance(value, bool),
}


def faults(
  config: Any,
  ranges: Mapping[str, str],
  choices: Mapping[str, Sequence[str]],
) -> list[str]:
  """Lists every field out of its range.

  Args:
    config: an object with the fields.
    ranges: a key of `TESTS` -> names of fields, with spaces between.
    choices: field -> its valid values.

  Returns:
    Such as "xi is 0; valid: an integer above 0".
  """
  found = [
    f"{name} is {getattr(config, name)!r}; valid: {valid}"
    for valid, names in ranges.items()
    for name in names.split()
    if not TESTS[valid](getattr(config, name))
  ]
  return found + [
    f"{name} is {getattr(config, name)!r}; valid: {', '.join(valid_values)}"
    for name, valid_values in choices.items()
    if getattr(config, name) not in valid_values
  ]
