"""Attribution of a failure to the imperfections that must be removed for success."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from robsim.analysis.explanation.ablation import (
    Ablation,
    AblationTrial,
    extend_duration,
    remove_imperfections,
    run_converging_trial,
    simulate_outcome,
)
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.path_changes import find_trial_changes
from robsim.analysis.explanation.text_format import format_list
from robsim.run.experiment import Experiment

# returns the trial of a case, or None if the case fails
SuccessTest = Callable[[Experiment], AblationTrial | None]


@dataclass(frozen=True)
class Attribution:
    """The causes of a failure, and the harmless imperfections."""

    causes: tuple[Finding, ...] = ()
    harmless: tuple[Ablation, ...] = ()
    alternatives: tuple[Ablation, ...] = ()  # causes of which any single removal is enough


def format_convergence(trial: AblationTrial) -> str:
    """Return the clause on the end of a run that converges."""
    return f"the same run {trial.clause}"


@dataclass(frozen=True)
class SuccessCriterion:
    """The test for success of a run, and the clause that describes success."""

    succeeds: SuccessTest = run_converging_trial
    describe: Callable[[AblationTrial], str] = format_convergence

    def attribute(self, case: Experiment, wrong: Sequence[Ablation]) -> Attribution:
        """Return the causes: imperfections are removed together, one by one, and in minimal sets.

        Trials have the duration of the run first, then three times this duration. A duration at
        which the unchanged run succeeds is skipped.
        """
        cases = (case, extend_duration(case)) if wrong else ()
        curable = [
            c
            for c in cases
            if not self.succeeds(c) and self.succeeds(remove_imperfections(c, wrong))
        ]
        for curable_case in curable:
            alone = [(one, self.succeeds(one.change(curable_case))) for one in wrong]
            if any(trial for _, trial in alone):
                return self._attribute_single(case, curable_case, alone)
        return self._attribute_set(case, curable[0], wrong) if curable else Attribution()

    def _attribute_single(
        self,
        original: Experiment,
        case: Experiment,
        alone: Sequence[tuple[Ablation, AblationTrial | None]],
    ) -> Attribution:
        """Return the attribution if removing a single imperfection is enough.

        `case` is the original, possibly with a longer duration.
        """
        cured = [(one, trial) for one, trial in alone if trial]
        causes = tuple(
            replace(
                self._report_single(one, trial, several=len(cured) > 1),
                changes=find_trial_changes(original, one.change(case), trial),
            )
            for one, trial in cured
        )
        harmless = tuple(one for one, trial in alone if not trial)
        return Attribution(causes, harmless, tuple(one for one, _ in cured) if cured[1:] else ())

    def _attribute_set(
        self, original: Experiment, case: Experiment, wrong: Sequence[Ablation]
    ) -> Attribution:
        """Return the attribution if no single removal is enough."""
        needed = self._find_minimal_set(case, wrong)
        cure = remove_imperfections(case, needed)
        trial = self.succeeds(cure)
        assert trial is not None
        end = simulate_outcome(case)
        ends = {one: simulate_outcome(one.change(case)) for one in needed}
        # first the imperfections that change the outcome when removed alone
        needed.sort(key=lambda one: ends[one] in (None, end))
        other = ends[needed[0]]
        alone = ""
        if other not in (None, end):
            alone = f": without {needed[0].name} alone the run ends as {other.name}"
        together = replace(
            self._report_set(needed, trial, alone),
            changes=find_trial_changes(original, cure, trial),
        )
        return Attribution((together,), tuple(one for one in wrong if one not in needed))

    def _report_single(self, one: Ablation, trial: AblationTrial, several: bool) -> Finding:
        """Return the finding on one imperfection that suffices alone."""
        evidence = one.finite_evidence | {"converges_after_s": trial.end_time}
        change = one.phrase or f"without {one.name}"
        others = ", and all else as it was" if several else ""
        result = f"{change[0].upper()}{change[1:]}{others}, {self.describe(trial)}."
        return Finding(one.about, f"{one.sentence} {result}", evidence)

    def _find_minimal_set(self, case: Experiment, wrong: Sequence[Ablation]) -> list[Ablation]:
        """Return a minimal set of imperfections that must be removed together."""
        needed = list(wrong)
        for one in wrong:
            fewer = [other for other in needed if other is not one]
            if self.succeeds(remove_imperfections(case, fewer)):
                needed = fewer
        return needed

    def _report_set(self, needed: Sequence[Ablation], trial: AblationTrial, alone: str) -> Finding:
        """Return the finding on imperfections that must be removed together."""
        sentences = " ".join(one.sentence for one in needed)
        names = format_list([one.name for one in needed])
        sentence = (
            f"{sentences} Correcting one of them is not enough{alone}. Only with {names} corrected "
            f"together, {self.describe(trial)}."
        )
        evidence = {key: value for one in needed for key, value in one.finite_evidence.items()}
        about = " and ".join(one.about for one in needed)
        return Finding(about, sentence, evidence | {"converges_after_s": trial.end_time})
