"""Named changes to the defaults, by the dotted names of config fields.

The hyper-parameter tables of the paper are the defaults themselves. A preset
that changes a field of `agent.reward` or `agent.scheduler` names its kind too:
with another kind, those changes are left out.
"""

from typing import Any

# The authors' later journal version; of cloning it changes nothing but the
# weight decay. Its data, 1000 pairs a task of which 200 are extra rows of
# success, is a matter of collection:
#   python launch/collect_demonstrations.py --task=stack --pairs_per_task=800 \
#       --final_pairs=200 --output=data/stack_ral
# It trains for 2 M steps, Insert for 4 M: --config.env_steps=2000000.
_RAL: dict[str, Any] = {
  "random_steps": 50_000,
  "warm_up": 25_000,
  "agent.critic.polyak": 1e-4,
  "agent.intention.initial_temperature": 0.01,
  "agent.optimiser.weight_decay": 0.01,
  "agent.reward.kind": "discriminator",
  "agent.reward.expert_share": 0.1,
  "agent.reward.expert_share_decay": 0.99999,
  "agent.reward.final_share": 0.95,
  "agent.scheduler.kind": "weighted_random_handcrafted",
}

# The authors' latest version: no discriminator, but +1 for a task's own
# examples of success and -1 for all else, scaled, with the value penalty. Its
# data, 200 final states a task: see launch/flags/examples.flags.
_VPACE: dict[str, Any] = {
  "control_hz": 5,
  "env_steps": 500_000,
  "evaluate_every": 25_000,
  "random_steps": 10_000,
  "warm_up": 5000,
  "agent.critic.polyak": 1e-3,
  "agent.critic.value_penalty": 10.0,
  "agent.intention.initial_temperature": 0.01,
  "agent.intention.learning_rate": 3e-4,
  "agent.networks.layout": "separate",
  "agent.optimiser.weight_decay": 0.01,
  "agent.reward.kind": "examples",
  "agent.reward.scale": 0.1,
  "agent.scheduler.kind": "weighted_random_handcrafted",
  "agent.scheduler.xi": 12,
}

# Ours: the fewest hours on two cores to the same success, from runs and trials
# in results/learning/. Control at 5 Hz (the authors' later rate) makes nine
# thousand pairs four times as much time; the intentions start from cloning and
# stay near it; discriminators recognise a task's end, from positions alone,
# since velocities and history give away whose success it is.
_FAST: dict[str, Any] = {
  "control_hz": 5,
  "random_steps": 0,
  "warm_up": 1800,
  "agent.batch_size": 64,
  "agent.critic.discount": 0.97,
  "agent.critic.polyak": 0.01,
  "agent.critic.warmup_updates": 3000,
  "agent.inputs.standardise": True,
  "agent.intention.initial_temperature": 0.0003,
  "agent.intention.learning_rate": 1e-4,
  "agent.intention.temperature_learning_rate": 0.001,
  "agent.networks.actor_trunk": "own",
  "agent.networks.critic_layer_norm": True,
  "agent.networks.hidden_size": 128,
  "agent.pretraining.std": 0.1,
  "agent.pretraining.updates": 10_000,
  "agent.prior.normalise": True,
  "agent.prior.weight": 5.0,
  "agent.reward.kind": "discriminator",
  "agent.reward.batch_size": 16,
  "agent.reward.clip": 5.0,
  "agent.reward.expert_share": 0.25,
  "agent.reward.final_share": 1.0,
  "agent.reward.form": "gail",
  "agent.reward.input": "state",
  "agent.reward.masked": "3:6,8:12,26:38,53:59",
  "agent.reward.noise": 0.3,
  "agent.reward.scale": 0.2,
  "agent.scheduler.kind": "weighted_random",
}

# Wide, for tasks on which narrow networks were not tried: three times as long
# an update.
_WIDE: dict[str, Any] = {
  **_FAST,
  "bfloat16": True,
  "agent.batch_size": 128,
  "agent.networks.hidden_size": 256,
  "agent.reward.batch_size": 32,
}

# Where millimetres decide (Bring, Insert): cloning by likelihood, a divergence
# as the prior (which has an entropy term of its own: the temperature is to
# vanish), and a discriminator of the main task's own, on blue and the fingers.
_FAST_PRECISE: dict[str, Any] = {
  **_WIDE,
  "env_steps": 40_000,
  "mirror_demonstrations": True,
  "updates_per_step": 0.5,
  "agent.critic.warmup_updates": 4000,
  "agent.intention.learning_rate": 0.00003,
  "agent.intention.target_entropy": -30.0,
  "agent.pretraining.learning_rate": 0.001,
  "agent.pretraining.loss": "likelihood",
  "agent.pretraining.std": 0.0,
  "agent.pretraining.updates": 30_000,
  "agent.prior.decay": 0.99998,
  "agent.prior.distance": "divergence",
  "agent.prior.weight": 0.1,
  "agent.reward.expert_share": 0.5,
  "agent.reward.main_masked": "0:6,8:12,19:47,50:59",
  "agent.scheduler.main_weight": 0.7,
  "agent.scheduler.xi": 90,
}

# From pixels. Cloning comes first (bc, multitask_bc); acting agents take its
# encoder and start as it left off (init_from). Their observations are what the
# robot senses, 18 floats, and features, which are standardised already.
_PIXELS: dict[str, Any] = {
  **_WIDE,
  "camera_size": 64,
  "env_steps": 40_000,
  "evaluate_every": 10_000,
  "agent.batch_size": 64,
  "agent.learning_rate": 1e-3,
  "agent.pretraining.updates": 0,
  "agent.reward.masked": "3:6,8:18",
}

# For 3 to 20 attempts a task, from scratch: every attempt counts as its images
# and shifted copies too; discriminators and critics see relative positions,
# heights and fingers, so that no few rows are recognisable by place;
# discriminators are sharp: a block 3 cm beside its goal has to be worth another
# grasp. Each task has networks of its own; critics follow fresh steps, of which
# there are two an update. Starts from the clone and priors gain nothing here.
_FEW: dict[str, Any] = {
  **_FAST,
  "env_steps": 144_000,
  "mirror_demonstrations": True,
  "random_steps": 1800,
  "shifted_copies": 30,
  "updates_per_step": 0.5,
  "agent.critic.learning_rate": 0.001,
  "agent.critic.masked": "0:2,3:6,8:14,15:21,22:38,41:44,50:59",
  "agent.critic.polyak": 0.03,
  "agent.critic.warmup_updates": 0,
  "agent.final_rows": 2,
  "agent.intention.initial_temperature": 0.01,
  "agent.intention.learning_rate": 3e-4,
  "agent.intention.target_entropy": -8.0,
  "agent.intention.temperature_learning_rate": 0.0003,
  "agent.learning_rate": 0.001,  # of BC
  "agent.networks.layout": "separate",
  "agent.pretraining.std": 0.0,
  "agent.pretraining.updates": 0,
  "agent.prior.weight": 0.0,
  "agent.reward.every": 2,
  "agent.reward.expert_share": 0.5,
  "agent.reward.gradient_penalty": 0.01,
  "agent.reward.gradient_penalty_per_task": True,
  "agent.reward.intentions_on_experts": False,
  "agent.reward.main_expert_share": 0.5,
  "agent.reward.masked": "0:2,3:6,8:14,15:21,22:38,47:59",
  "agent.reward.noise": 0.1,
  "agent.scheduler.kind": "weighted_random_handcrafted",
  "agent.scheduler.xi": 12,
}

# Where a slot is the goal: blue from it, the hand from blue, and the fingers.
_FEW_SLOT: dict[str, Any] = {
  "agent.reward.kind": "discriminator",
  "agent.reward.main_masked": "0:6,8:14,15:38,41:47,50:59",
}

# Half a millimetre decides: a delay of one step is worth more than critics err
# by; long periods; the hand does not count, and the millimetres do. Blue's tilt
# tells a wedged block from one on its way in: critics that see it from the
# start hardly learn the task; later, when most tries succeed, it makes them
# finer.
_FEW_INSERT: dict[str, Any] = {
  "env_steps": 216_000,
  "shifted_copies": 0,  # it takes thousands of pairs
  "agent.critic.discount": 0.93,
  "agent.critic.masked": "0:2,3:6,8:14,15:16,18:21,22:38,41:44,50:59",
  "agent.critic.revealed": "16:18",  # x and y of blue's quaternion
  "agent.critic.revealed_after": 36_000,
  "agent.inputs.tanh_feature_scale": 0.01,  # m
  "agent.intention.target_entropy": -12.0,
  "agent.reward.kind": "discriminator",
  "agent.reward.gradient_penalty": 0.003,
  "agent.reward.main_masked": "0:6,8:14,15:47,50:59",
  "agent.reward.noise": 0.05,
  "agent.scheduler.kind": "weighted_random_handcrafted",
  "agent.scheduler.main_weight": 0.7,
  "agent.scheduler.xi": 45,
}

PRESETS: dict[str, dict[str, Any]] = {
  "paper": {},
  "ral": _RAL,
  "vpace": _VPACE,
  "fast": _FAST,
  "fast_precise": _FAST_PRECISE,
  "few": _FEW,
  "pixels": _PIXELS,
}

# What they know of our blocks: symmetries, which of the 59 floats to hide, and
# sequences of tasks. With another environment these are left out.
OF_BLOCKS = (
  "mirror_demonstrations",
  "shifted_copies",
  "agent.critic.masked",
  "agent.critic.revealed",
  "agent.critic.revealed_after",
  "agent.reward.masked",
  "agent.reward.main_masked",
)
HANDCRAFTED = "weighted_random_handcrafted"  # else: weighted_random

# What a main task changes of a preset: half a millimetre decides Insert.
OF_TASK: dict[tuple[str, str], dict[str, Any]] = {
  ("vpace", "insert"): {
    "env_steps": 1_000_000,
    "random_steps": 20_000,
  },
  ("few", "bring"): _FEW_SLOT,
  ("few", "insert"): _FEW_INSERT,
  ("fast_precise", "insert"): {
    "bfloat16": False,
    "env_steps": 80_000,
    "agent.inputs.tanh_feature_scale": 0.01,  # m
    "agent.intention.learning_rate": 0.00001,
  },
}
