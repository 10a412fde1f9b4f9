"""Which of the things that are wrong in a run are the cause: those without which it goes well."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from robsim.analysis.case import Case
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.removal import Removal, Trial, cures, patient, without
from robsim.analysis.explanation.wording import listed, number

Cure = Callable[[Case], Trial | None]  # the trial of a case, if it goes well


@dataclass(frozen=True)
class Attribution:
    """The causes that were found, and which of the other things do no harm."""

    causes: tuple[Finding, ...] = ()
    harmless: tuple[Removal, ...] = ()


def converges(trial: Trial) -> str:
    """How it goes when it goes well."""
    return f"the same run converges after {number(trial.end_time)} s"


@dataclass(frozen=True)
class Jury:
    """What it is for a run to go well, and how that is said."""

    cured: Cure = cures
    so: Callable[[Trial], str] = converges

    def attributed(self, case: Case, wrong: Sequence[Removal]) -> Attribution:
        """Put things right and look whether it goes well: all, one by one, then the fewest.

        A run that is given three times its duration may take it; first none is.
        """
        for changed in (case, patient(case)):
            if wrong and (trial := self.cured(without(changed, wrong))):
                return self._among(changed, wrong, trial)
        return Attribution()

    def _among(self, case: Case, wrong: Sequence[Removal], all_right: Trial) -> Attribution:
        if len(wrong) == 1:
            return Attribution((self._alone(wrong[0], all_right, several=False),))
        alone = [(one, self.cured(one.change(case))) for one in wrong]
        found = [(one, trial) for one, trial in alone if trial]
        if found:
            causes = tuple(self._alone(*pair, several=len(found) > 1) for pair in found)
            return Attribution(causes, tuple(one for one, trial in alone if not trial))
        needed = self._fewest(case, wrong)
        together = self._together(needed, self.cured(without(case, needed)) or all_right)
        return Attribution((together,), tuple(one for one in wrong if one not in needed))

    def _alone(self, one: Removal, trial: Trial, several: bool) -> Finding:
        evidence = one.evidence | {"converges_after_s": trial.end_time}
        right = one.undone or f"without {one.name}"
        only = f"{right[0].upper()}{right[1:]}{' alone' if several else ''}, {self.so(trial)}."
        return Finding(one.about, f"{one.sentence} {only}", evidence)

    def _fewest(self, case: Case, wrong: Sequence[Removal]) -> list[Removal]:
        """What must be put right together: all that cannot be left wrong."""
        needed = list(wrong)
        for one in wrong:
            fewer = [other for other in needed if other is not one]
            if self.cured(without(case, fewer)):
                needed = fewer
        return needed

    def _together(self, needed: Sequence[Removal], trial: Trial) -> Finding:
        said = " ".join(one.sentence for one in needed)
        names = listed([one.name for one in needed])
        sentence = (
            f"{said} To put right one of them is not enough: only with all of {names} put right, "
            f"{self.so(trial)}."
        )
        evidence = {key: value for one in needed for key, value in one.evidence.items()}
        about = " and ".join(one.about for one in needed)
        return Finding(about, sentence, evidence | {"converges_after_s": trial.end_time})
