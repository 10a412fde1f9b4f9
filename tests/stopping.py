"""A simulation that is stopped, for the tests of the part that is kept."""

import functools

import robsim as rs


def stop_at_the_second(monkeypatch, left=lambda run: run):
    """Stop the second simulated run and keep `left` of it; return the function that runs one."""
    run_of, calls = rs.Experiment.run, []

    @functools.wraps(run_of)
    def stopped(*arguments, **settings):
        calls.append(arguments)
        run = run_of(*arguments, **settings)
        if len(calls) == 2:
            raise rs.errors.Interrupted("stopped", left(run))
        return run

    monkeypatch.setattr(rs.Experiment, "run", stopped)
    return run_of
