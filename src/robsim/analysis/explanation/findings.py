"""`Finding`: one element of an explanation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from robsim.declare.context import Raw


@dataclass(frozen=True)
class Finding:
    """A cause, a remark or a piece of advice, as a sentence with the numbers behind it.

    Attributes
    ----------
    about : str
        Short name of the subject, such as "latency" or "joint limit".
    sentence : str
        The finding as a sentence.
    evidence : dict of str to float
        Numbers by name, in the units of the sentence.
    changes : dict of str to object
        Values at dotted names with which `Experiment.at` returns the experiment that was tried.
        Empty if nothing was tried, or if the change cannot be written in this way.

    Examples
    --------
    >>> Finding("noise", "The pixels are noisy.", {"noise_px": 0.5}).evidence["noise_px"]
    0.5
    """

    about: str
    sentence: str
    evidence: dict[str, float] = field(default_factory=dict)
    changes: Mapping[str, Raw] = field(default_factory=dict)
