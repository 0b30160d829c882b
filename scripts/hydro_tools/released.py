"""Names of the released checkpoints, folders of `models/`."""

RELEASED = (
    "b1-relaxation",
    "b1-strip",
    "b1-strip-attention-ode",
    "b1-strip-cnode",
    "b1-strip-lstm",
    "b1-strip-mlp-ode",
    "b1-task2",
)
