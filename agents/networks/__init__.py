"""Networks of the paper's supplement, per-task heads stacked in one tensor."""
