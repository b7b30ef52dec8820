"""Schedulers choose the intention that acts for the next xi steps."""

from lfgp_dmc.agents.schedulers.base import Scheduler, period_returns
from lfgp_dmc.agents.schedulers.factory import make_scheduler

__all__ = ["Scheduler", "make_scheduler", "period_returns"]
