"""`explain`: report what happened in a run, when, why, and what to try."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robsim.analysis.explanation.ablation import (
    Ablation,
    extend_duration,
    remove_imperfections,
    run_trial,
)
from robsim.analysis.explanation.attribution import Attribution, SuccessCriterion
from robsim.analysis.explanation.final_pose import report_final_pose
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.imperfections import list_imperfections
from robsim.analysis.explanation.log_comparison import LogComparison
from robsim.analysis.explanation.outcome_sentences import describe_run_end
from robsim.analysis.explanation.reasons import generate_reasons
from robsim.analysis.explanation.remedies import find_remedies
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_list, format_number
from robsim.analysis.resimulation import resimulate_run
from robsim.base.arrays import as_bool
from robsim.base.html import format_html_table
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment
from robsim.run.log_commands import is_log_run
from robsim.run.provenance import check_run, read_run_settings
from robsim.run.run_checks import check_instance

if TYPE_CHECKING:
    import xarray as xr

ExplanationParts = tuple[
    tuple[Finding, ...], tuple[Finding, ...], tuple[str, ...]
]  # see `Explanation`
_NO_FAILURE = (Outcome.CONVERGED, Outcome.RUNNING, Outcome.ENDED)


@dataclass(frozen=True)
class Explanation:
    """An account of what happened in a run, when, why, and what to try.

    outcome  how the run ended
    what     a sentence
    when     seconds since the start
    causes   reasons, most important first; for a run that converged, what is notable
    advice   changes with which the same run converges
    remarks  further observations

    >>> Explanation(Outcome.CONVERGED, "After 1 s the run converged.", 1.0)
    Explanation(CONVERGED after 1 s: 0 causes, 0 pieces of advice)
    """

    outcome: Outcome
    what: str
    when: float
    causes: tuple[Finding, ...] = ()
    advice: tuple[Finding, ...] = ()
    remarks: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return a few plain sentences, one line for each finding."""
        return "\n".join([self.what, *(f"{head}: {text}" for head, text in self._rows())])

    def _repr_html_(self) -> str:
        """Return what `print` shows as a table for notebooks."""
        return format_html_table(self.what, self._rows())

    def _rows(self) -> list[tuple[str, str]]:
        why = "Note" if self.outcome in _NO_FAILURE else "Why"
        rows = [(why, cause.sentence) for cause in self.causes]
        rows += [("Note", remark) for remark in self.remarks]
        return rows + [("Try", advice.sentence) for advice in self.advice]

    def __repr__(self) -> str:
        """Return one line: the outcome, and how many causes and pieces of advice."""
        return (
            f"Explanation({self.outcome.name} after {self.when:g} s: {len(self.causes)} causes, "
            f"{len(self.advice)} pieces of advice)"
        )


def explain(
    run: xr.Dataset, experiment: Experiment | None = None, *, trials: bool = True
) -> Explanation:
    """Explain why a single run ended as it did, by repeating it with one change at a time.

    The imperfections of images, joints, depths and beliefs are removed, together and one by one: a
    cause is one without which the run converges. If none is the cause, reasons are read from the
    `diagnose` of the run: null spaces, lost ranks, retreat, loop gain, limits. The advice are other
    gains, interaction matrices and laws with which the same start was found to converge. Without
    `trials` nothing is changed, only read.

    The run contains the text of its experiment; where that is Python code, give the experiment.

    Of a run that was recorded (`read_bag`, `read_log`) the causes are how it differs from its
    experiment: commands from those of the controller for the same images and joints, motion from
    the commands, marks from where the scene has them, and the images' age. A remark says how the
    experiment ends when it is simulated from the same start.

    InputError: no single run, or one that cannot be repeated.

    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> run = load_scenario(examples.path("local_minimum")).run()
    >>> print(explain(run, trials=False).causes[0].about)
    local minimum
    """
    check_run(run)
    if is_log_run(run):
        return _explain_log(run, experiment, as_bool(trials, "trials"))
    inquiry = RunAnalysis(**vars(resimulate_run(run, experiment)), trials=as_bool(trials, "trials"))
    found = (
        _explain_success(inquiry, run)
        if inquiry.outcome in _NO_FAILURE
        else _explain_failure(inquiry)
    )
    return Explanation(inquiry.outcome, describe_run_end(inquiry), inquiry.end, *found)


def _explain_success(inquiry: RunAnalysis, run: xr.Dataset) -> ExplanationParts:
    """Return what is notable in a run that went well, or that somebody ended."""
    converged = inquiry.outcome is Outcome.CONVERGED
    notable = (*report_final_pose(inquiry), *generate_reasons(inquiry)) if converged else ()
    return notable, (), _describe_unstopped_run(inquiry, run)


def _explain_failure(inquiry: RunAnalysis) -> ExplanationParts:
    """Return the causes of a failure, advice, and remarks."""
    wrong, trials = list_imperfections(inquiry), inquiry.trials
    found = SuccessCriterion().attributed(inquiry.case, wrong) if trials else Attribution()
    causes = found.causes or tuple(generate_reasons(inquiry))
    advice = tuple(find_remedies(inquiry)) if trials else ()
    return causes, advice, _list_remarks(inquiry.case, found, wrong, trials)


def _explain_log(run: xr.Dataset, experiment: Experiment | None, trials: bool) -> Explanation:
    """Return the account of a run that was recorded."""
    case = (
        check_instance(experiment, Experiment, "experiment") if experiment else Experiment.of(run)
    )
    case = case.with_(**read_run_settings(run))
    evidence, end = LogComparison(run, case), float(run["end_time"])
    remarks = list(evidence.remarks())
    trial = run_trial(extend_duration(case.with_(hold=False))) if trials else None
    if trial is not None:
        simulated = f"{trial.outcome.name} after {format_number(trial.end_time)} s"
        remarks.append(f"Simulated from the same start, the experiment ends as {simulated}.")
    causes = tuple(evidence.findings())
    outcome = Outcome(int(run["outcome"]))
    return Explanation(outcome, evidence.what(), end, causes, (), tuple(remarks))


def _describe_ideal_run(case: Experiment, wrong: list[Ablation]) -> str:
    """Return how a run ends that fails even with every imperfection removed."""
    trial = run_trial(remove_imperfections(extend_duration(case), wrong))
    if trial is None:
        return "with all of it put right the run cannot be simulated"
    if trial.converged:
        return "but only time is lacking"
    return f"with all of it put right the run ends as {trial.outcome.name} {trial.end}"


def _describe_harm(removals: Sequence[Ablation]) -> str:
    """Return in which way there are some: a limit of the safety is not wrong."""
    limits = [one.about.startswith("safety.") for one in removals]
    if all(limits):
        return "in the way"
    return "wrong or in the way" if any(limits) else "wrong"


def _list_remarks(
    case: Experiment, found: Attribution, wrong: list[Ablation], trials: bool
) -> tuple[str, ...]:
    """Return remarks on the imperfections that are not the cause."""
    if not wrong:
        return ()
    names = format_list([one.name for one in wrong])
    if not trials:
        return (f"Also {_describe_harm(wrong)} in this run, and not examined: {names}.",)
    if not found.causes:
        words = f"{_describe_harm(wrong)} as well"
        return (f"{words[0].upper()}{words[1:]}: {names}; {_describe_ideal_run(case, wrong)}.",)
    remarks = []
    if found.one_too_many:
        names = format_list([one.name for one in found.one_too_many])
        remarks += [f"Only together do {names} harm: it is enough to put one of them right."]
    if found.harmless:
        names = format_list([one.name for one in found.harmless])
        remarks += [f"Not the cause, though {_describe_harm(found.harmless)} as well: {names}."]
    return tuple(remarks)


def _describe_unstopped_run(inquiry: RunAnalysis, run: xr.Dataset) -> tuple[str, ...]:
    """Return how a run that was stopped would have ended."""
    if inquiry.outcome is not Outcome.RUNNING or not inquiry.trials:
        return ()
    duration = float(run.attrs["duration"]) - 0.5 * inquiry.case.dt
    trial = run_trial(inquiry.case.with_(duration=duration))
    if trial is None:
        return ()
    return (f"Left alone it ends as {trial.outcome.name} after {format_number(trial.end_time)} s.",)
