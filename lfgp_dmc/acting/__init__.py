"""Stepping environments: rollouts, collection, evaluation, worker processes."""
