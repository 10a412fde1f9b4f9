"""What an explanation is made of."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Finding:
    """One cause, remark or piece of advice: a sentence, and the numbers it rests on.

    about     a short name of what it is about, such as "latency" or "joint limit"
    evidence  numbers by name, in the units that the sentence says

    >>> Finding("noise", "The pixels are noisy.", {"noise_px": 0.5}).evidence["noise_px"]
    0.5
    """

    about: str
    sentence: str
    evidence: dict[str, float] = field(default_factory=dict)
