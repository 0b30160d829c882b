"""Hidden-effect cases: trials of a truth that differs from a nominal model by a known physical effect.

The truth is code of its own. It shares nothing with the tool that is tested on the cases: other forms
of the effects, a finer step, another integrator, perturbed nominal parameters.
"""


class HiddenCaseError(Exception):
    """A case that cannot be made, a file that cannot be read: with what was found and what was expected."""
