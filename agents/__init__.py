"""The learning side: networks, losses, schedulers, learners and agents.

Imports torch and `lfgp_dmc`; never a simulator. Inside this room, tensors that
differ by task lead with the task axis: `[K, B, ...]`, and twin critics lead
with the twin: `[2, K, B]`. Shapes follow the legend of `lfgp_dmc/types.py`.
"""
