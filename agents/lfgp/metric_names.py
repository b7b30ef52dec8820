"""The metrics of an LfGP agent, which are NaN where an option is off."""

# What `LfgpLearner.update` reports; the second are [K].
SCALAR_METRICS = (
  "loss/discriminator",
  "loss/gradient_penalty",
  "loss/critic",
  "loss/value_penalty",
  "loss/policy",
  "loss/temperature",
  "gradient_norm/discriminator_input",
  "gradient_norm/critic",
  "gradient_norm/policy",
  "gradient_norm/temperature",
)
TASK_METRICS = (
  "accuracy_expert",
  "accuracy_policy",
  "logit_expert",
  "logit_policy",
  "reward",
  "q",
  "q_max",  # largest |Q| of the batch
  "q_bound",  # largest |reward| of the batch / (1 - gamma)
  "value_low",  # bounds of the value penalty
  "value_high",
  "temperature",
  "entropy",
  "saturation",  # share of the intention's action floats beyond 0.99
  "distance_from_prior",  # squared, of mean actions; a divergence: nats
)
