"""A checkpoint of `hydro.wrench` in MuJoCo Warp: its network's force in every world.

settings.py    the attributes that belong to a checkpoint
card.py        card and weights, read
robot.py       features and outputs tied to a model
encoding.py    how samples are encoded
lanes.py       numbers of worlds side by side
sampling.py    what a network is given, and what it gives
perceptron.py  perceptrons
relaxation.py  the Relaxation-ODE
force_ode.py   the MLP-ODE and the Attention-ODE
lstm.py        the LSTM
cnode.py       the CNODE
mlp.py         the memoryless perceptron
learned.py     clock, features, network and force together
kernels/       Warp kernels
"""
