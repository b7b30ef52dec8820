"""Lets absltest's temporary folders work under pytest, which parses no flags."""

from absl import flags

flags.FLAGS.mark_as_parsed()
