"""`Finding`: one element of an explanation."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Finding:
    """A cause, a remark or a piece of advice, as a sentence with the numbers behind it.

    about     a short name of what it is about, such as "latency" or "joint limit"
    evidence  numbers by name, in the units given in the sentence

    >>> Finding("noise", "The pixels are noisy.", {"noise_px": 0.5}).evidence["noise_px"]
    0.5
    """

    about: str
    sentence: str
    evidence: dict[str, float] = field(default_factory=dict)
