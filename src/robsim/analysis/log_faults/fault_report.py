"""The finding on a chosen fault: its sentence and its numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.log_faults.fault_choice import FaultChoice
from robsim.analysis.log_faults.hypothesis import HypothesisFit


def report_fault(choice: FaultChoice, signals: str, format_rms: Callable[[float], str]) -> Finding:
    """Return the finding on the fault of a choice, or on the group that the log cannot separate.

    `signals` names the signals, and `format_rms` formats their residuals.
    """
    best, group = choice.best, choice.group
    clauses = [choice.describe(each) for each in group]
    if len(clauses) == 1:
        sentence = f"{clauses[0][0].upper()}{clauses[0][1:]}."
    else:
        sentence = f"The log cannot separate {len(clauses)} faults: {'; or '.join(clauses)}."
    sentence += f" With this the {signals} deviate by {format_rms(best.rms)}, without it by "
    sentence += f"{format_rms(choice.healthy.rms)} (rms). BIC falls by {choice.gap:.0f}"
    runner_up, behind = choice.next
    if runner_up is not choice.healthy:
        sentence += f", and with the next fault ({runner_up.hypothesis.about}) {behind:.0f} less"
    evidence = _list_evidence(choice, best) | {
        "bic_gap": choice.gap,
        "next_gap": behind,
        "rms": best.rms,
        "rms_without": choice.healthy.rms,
    }
    return Finding(_name_faults(group), f"{sentence}.", evidence)


def _name_faults(group: Iterable[HypothesisFit]) -> str:
    """Return the kinds of faults of a group, each once."""
    return " or ".join(dict.fromkeys(each.hypothesis.about for each in group))


def _list_evidence(choice: FaultChoice, fit: HypothesisFit) -> dict[str, float]:
    """Return the numbers of a fault, and the half widths of their intervals."""
    half = fit.compute_half_widths(choice.samples, choice.floor)
    each = list(zip(fit.hypothesis.names, fit.values.tolist(), half.tolist(), strict=True))
    return {name: x for name, x, _ in each} | {f"{name}_half_width": d for name, _, d in each}
