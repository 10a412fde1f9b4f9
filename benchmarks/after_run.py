"""What a person waits for after a long run: its explanation and its page (see README.md)."""

import tempfile
import time
from pathlib import Path

import robsim as rs

TURNS = 3
# seconds before explanations read the states of all instants from one batch
BEFORE = {"explain, 10,001 instants": 2.9, "export_html, 10,001 instants": 3.7}


def least(call):
    """Least seconds of CPU of some turns."""
    found = []
    for _ in range(TURNS):
        begin = time.process_time()
        call()
        found.append(time.process_time() - begin)
    return min(found)


def measure_long_run():
    """Seconds of CPU to explain and to export a run of 10,001 instants."""
    experiment = rs.load_scenario(rs.examples.path("eye_in_hand"))
    run = experiment.with_(dt=0.004, duration=40.0, hold=True).run()
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "run.html"
        return {
            "explain, 10,001 instants": least(lambda: rs.explain(run)),
            "export_html, 10,001 instants": least(lambda: rs.export_html(run, page)),
        }


def main():
    """Print the table."""
    for name, seconds in measure_long_run().items():
        print(f"{name:30} {seconds:6.2f} s, before {BEFORE[name]:.1f} s")


if __name__ == "__main__":
    main()
