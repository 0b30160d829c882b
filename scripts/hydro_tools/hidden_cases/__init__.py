"""Hidden-effect cases: trials of a truth that differs from a nominal model by a known physical effect.

The truth shares no code with the tool that is tested on the cases: other forms of the effects, a finer step, another
integrator, perturbed nominal parameters.

plan.py              the list of cases of a seed
case.py              one case, made and written
systems/             the systems: vehicle, leg, towed and swimming B1; any MJCF (generic.py)
effects/             the hidden effects
plant.py             the truth, stepped
perturbation.py      its nuisance parameters
checkpoint_water.py  the learned water, evaluated in numpy
excitation.py        signals that drive a system
measurement.py       filter, sampling and noise of the logs
trialfile.py         a trial file
strength.py          strength of an effect in the outputs
scenes.py, frames.py nominal scenes; rotations
gap.py               `hydro gap run` on a case
score/               verdicts against the answers
"""


class HiddenCaseError(Exception):
    """A case that cannot be made, a file that cannot be read: with what was found and what was expected."""
