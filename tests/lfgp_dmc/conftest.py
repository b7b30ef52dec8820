"""Lets absltest make temporary folders under pytest, which parses no flags."""

from absl import flags

flags.FLAGS.mark_as_parsed()
