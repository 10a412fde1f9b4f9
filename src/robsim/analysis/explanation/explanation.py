"""`explain`: report the outcome of a run, its causes, and changes that make it converge."""

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
from robsim.analysis.explanation.final_pose import advise_final_pose, report_final_pose
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

# causes, advice and remarks of an `Explanation`
ExplanationParts = tuple[tuple[Finding, ...], tuple[Finding, ...], tuple[str, ...]]
_NO_FAILURE = (Outcome.CONVERGED, Outcome.RUNNING, Outcome.ENDED)


@dataclass(frozen=True)
class Explanation:
    """Explanation of a run: its outcome and end, the causes, and changes that help.

    Attributes
    ----------
    outcome : Outcome
        Outcome of the run.
    what : str
        Sentence on the end of the run.
    when : float
        Time of the end in seconds since the start.
    causes : tuple of Finding
        Causes, most important first; for a converged run, notable facts.
    advice : tuple of Finding
        Changes that let the run converge from the same start.
    remarks : tuple of str
        Further observations.

    Examples
    --------
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
        """Return the printed text as a table for notebooks."""
        return format_html_table(self.what, self._rows())

    def _rows(self) -> list[tuple[str, str]]:
        why = "Note" if self.outcome in _NO_FAILURE else "Why"
        rows = [(why, cause.sentence) for cause in self.causes]
        rows += [("Note", remark) for remark in self.remarks]
        return rows + [("Try", advice.sentence) for advice in self.advice]

    def __repr__(self) -> str:
        """Return one line: the outcome, and the numbers of causes and of pieces of advice."""
        return (
            f"Explanation({self.outcome.name} after {self.when:g} s: {len(self.causes)} causes, "
            f"{len(self.advice)} pieces of advice)"
        )


def explain(
    run: xr.Dataset, experiment: Experiment | None = None, *, trials: bool = True
) -> Explanation:
    """Explain the outcome of a single run, by simulating it again with one change at a time.

    Imperfections of images, joints, depths and beliefs are removed, together and one by one. A
    cause is an imperfection without which the run converges. If there is no cause of this kind, the
    causes come from the diagnosis of the run (see `diagnose`): null spaces, lost ranks, retreat,
    loop gain and limits. The advice lists other gains, interaction matrices and laws that let the
    run converge from the same start.

    For a recorded run (`read_bag`, `read_log`) the causes are its differences from its experiment.
    Possible faults (poses of camera and target, lens, joint offsets, times of images, drives,
    delays, swapped columns) are fitted one at a time by nonlinear least squares: to the pixels, to
    the motion of the joints, and to the commands. The fault with the least BIC is a cause if its
    BIC is at least 20 below the robot without a fault; faults that the log cannot separate are one
    cause. Lost and old images are causes, too. A remark reports the outcome of the experiment,
    simulated from the same start.

    Parameters
    ----------
    run : Dataset
        A single run.
    experiment : Experiment, optional
        Experiment of the run; needed if it contains Python code. Default: the experiment stored in
        the run.
    trials : bool, default True
        Whether to simulate the run with changes. If false, the run is only analysed.

    Returns
    -------
    Explanation
        Outcome, causes and advice; `print` shows them.

    Raises
    ------
    InputError
        If `run` is no single run, or cannot be simulated again.

    Examples
    --------
    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> run = load_scenario(examples.path("local_minimum")).run()
    >>> print(explain(run, trials=False).causes[0].about)
    local minimum
    """
    check_run(run)
    if is_log_run(run):
        return _explain_log(run, experiment, as_bool(trials, "trials"))
    analysis = RunAnalysis(
        **vars(resimulate_run(run, experiment)), trials=as_bool(trials, "trials")
    )
    parts = (
        _explain_success(analysis, run)
        if analysis.outcome in _NO_FAILURE
        else _explain_failure(analysis)
    )
    return Explanation(analysis.outcome, describe_run_end(analysis), analysis.end, *parts)


def _explain_success(analysis: RunAnalysis, run: xr.Dataset) -> ExplanationParts:
    """Return the notable facts of a run that converged, or that was ended on purpose."""
    converged = analysis.outcome is Outcome.CONVERGED
    notable = (*report_final_pose(analysis), *generate_reasons(analysis)) if converged else ()
    advice = advise_final_pose(analysis) if converged else ()
    return notable, advice, _describe_unstopped_run(analysis, run)


def _explain_failure(analysis: RunAnalysis) -> ExplanationParts:
    """Return the causes of a failure, advice, and remarks."""
    wrong, trials = list_imperfections(analysis), analysis.trials
    attribution = SuccessCriterion().attribute(analysis.case, wrong) if trials else Attribution()
    causes = attribution.causes or tuple(generate_reasons(analysis))
    advice = tuple(find_remedies(analysis)) if trials else ()
    return causes, advice, _list_remarks(analysis.case, attribution, wrong, trials)


def _explain_log(run: xr.Dataset, experiment: Experiment | None, trials: bool) -> Explanation:
    """Return the explanation of a recorded run."""
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
    return Explanation(outcome, evidence.describe_end(), end, causes, (), tuple(remarks))


def _describe_ideal_run(case: Experiment, wrong: list[Ablation]) -> str:
    """Return a clause on the end of a failed run if all imperfections are removed."""
    trial = run_trial(remove_imperfections(extend_duration(case), wrong))
    if trial is None:
        return "with all of it corrected the run cannot be simulated"
    if trial.converged:
        return "but the run only needs more time"
    return f"with all of it corrected the run ends as {trial.outcome.name} {trial.end}"


def _describe_harm(removals: Sequence[Ablation]) -> str:
    """Return the adjective for imperfections: "in the way" for safety limits, else "wrong"."""
    limits = [one.about.startswith("safety.") for one in removals]
    if all(limits):
        return "in the way"
    return "wrong or in the way" if any(limits) else "wrong"


def _list_remarks(
    case: Experiment, attribution: Attribution, wrong: list[Ablation], trials: bool
) -> tuple[str, ...]:
    """Return remarks on the imperfections that are no causes."""
    if not wrong:
        return ()
    names = format_list([one.name for one in wrong])
    if not trials:
        return (f"Also {_describe_harm(wrong)} in this run, and not examined: {names}.",)
    if not attribution.causes:
        adjective = f"{_describe_harm(wrong)} as well"
        return (
            f"{adjective[0].upper()}{adjective[1:]}: {names}; {_describe_ideal_run(case, wrong)}.",
        )
    remarks = []
    if attribution.alternatives:
        names = format_list([one.name for one in attribution.alternatives])
        remarks += [
            f"Only the combination of {names} is harmful: correcting one of them is enough."
        ]
    if attribution.harmless:
        names = format_list([one.name for one in attribution.harmless])
        remarks += [
            f"Not the cause, though {_describe_harm(attribution.harmless)} as well: {names}."
        ]
    return tuple(remarks)


def _describe_unstopped_run(analysis: RunAnalysis, run: xr.Dataset) -> tuple[str, ...]:
    """Return a remark on the end of a stopped run without the stop."""
    if analysis.outcome is not Outcome.RUNNING or not analysis.trials:
        return ()
    duration = float(run.attrs["duration"]) - 0.5 * analysis.case.dt
    trial = run_trial(analysis.case.with_(duration=duration))
    if trial is None:
        return ()
    end = format_number(trial.end_time)
    return (f"Without the stop it ends as {trial.outcome.name} after {end} s.",)
