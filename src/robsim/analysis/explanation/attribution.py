"""Attribution of a failure to imperfections: those whose removal makes the run succeed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from robsim.analysis.explanation.ablation import (
    Ablation,
    AblationTrial,
    extend_duration,
    remove_imperfections,
    run_converging_trial,
    simulate_outcome,
)
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.text_format import format_list
from robsim.run.experiment import Experiment

SuccessTest = Callable[
    [Experiment], AblationTrial | None
]  # returns the trial of a case if it succeeds


@dataclass(frozen=True)
class Attribution:
    """The causes that were found, and the imperfections that do no harm."""

    causes: tuple[Finding, ...] = ()
    harmless: tuple[Ablation, ...] = ()
    one_too_many: tuple[Ablation, ...] = ()  # causes of which removing any one is enough


def format_convergence(trial: AblationTrial) -> str:
    """Return the clause that says how a run that converges ends."""
    return f"the same run {trial.ending}"


@dataclass(frozen=True)
class SuccessCriterion:
    """What counts as success of a run, and the clause that describes it."""

    cured: SuccessTest = run_converging_trial
    so: Callable[[AblationTrial], str] = format_convergence

    def attributed(self, case: Experiment, wrong: Sequence[Ablation]) -> Attribution:
        """Find the causes by removing imperfections: all, then one by one, then the fewest.

        Trials have the duration of the run, and then three times that, unless more time is enough.
        """
        cases = (case, extend_duration(case)) if wrong else ()
        able = [
            c for c in cases if not self.cured(c) and self.cured(remove_imperfections(c, wrong))
        ]
        for changed in able:
            alone = [(one, self.cured(one.change(changed))) for one in wrong]
            if any(trial for _, trial in alone):
                return self._each(alone)
        return self._all(able[0], wrong) if able else Attribution()

    def _each(self, alone: Sequence[tuple[Ablation, AblationTrial | None]]) -> Attribution:
        """Return the attribution where removing a single imperfection is enough."""
        found = [(one, trial) for one, trial in alone if trial]
        causes = tuple(self._alone(*pair, several=len(found) > 1) for pair in found)
        harmless = tuple(one for one, trial in alone if not trial)
        return Attribution(causes, harmless, tuple(one for one, _ in found) if found[1:] else ())

    def _all(self, case: Experiment, wrong: Sequence[Ablation]) -> Attribution:
        """Return the attribution where no single removal is enough."""
        needed = self._fewest(case, wrong)
        trial = self.cured(remove_imperfections(case, needed))
        assert trial is not None
        end, ends = (
            simulate_outcome(case),
            {one: simulate_outcome(one.change(case)) for one in needed},
        )
        # first those whose removal alone changes the outcome
        needed.sort(key=lambda one: ends[one] in (None, end))
        other = ends[needed[0]]
        alone = ""
        if other not in (None, end):
            alone = f": without {needed[0].name} alone the run ends as {other.name}"
        together = self._together(needed, trial, alone)
        return Attribution((together,), tuple(one for one in wrong if one not in needed))

    def _alone(self, one: Ablation, trial: AblationTrial, several: bool) -> Finding:
        evidence = one.known | {"converges_after_s": trial.end_time}
        right = one.undone or f"without {one.name}"
        rest = ", and all else as it was" if several else ""
        only = f"{right[0].upper()}{right[1:]}{rest}, {self.so(trial)}."
        return Finding(one.about, f"{one.sentence} {only}", evidence)

    def _fewest(self, case: Experiment, wrong: Sequence[Ablation]) -> list[Ablation]:
        """Return a minimal set of imperfections that must be removed together."""
        needed = list(wrong)
        for one in wrong:
            fewer = [other for other in needed if other is not one]
            if self.cured(remove_imperfections(case, fewer)):
                needed = fewer
        return needed

    def _together(self, needed: Sequence[Ablation], trial: AblationTrial, alone: str) -> Finding:
        sentences = " ".join(one.sentence for one in needed)
        names = format_list([one.name for one in needed])
        sentence = (
            f"{sentences} To put right one of them is not enough{alone}. Only with {names} put "
            f"right together, {self.so(trial)}."
        )
        evidence = {key: value for one in needed for key, value in one.known.items()}
        about = " and ".join(one.about for one in needed)
        return Finding(about, sentence, evidence | {"converges_after_s": trial.end_time})
