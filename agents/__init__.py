"""The learning side: networks, losses, schedulers, learners and agents.

Imports torch and `lfgp_dmc`; never a simulator. Inside this room, tensors that
differ by task lead with the task axis: `[K, B, ...]`, and twin critics lead
with the twin: `[2, K, B]`. Shapes follow the legend of `lfgp_dmc/types.py`.
Everywhere, `tasks` are the K tasks' names or their number, the main task first;
a `generator` is the source of all random numbers of what it is passed to, a
`device` that of its tensors, a `dtype` that of its products.
"""
