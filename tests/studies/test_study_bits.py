"""One hash, however the runs of a study are cut, spread, killed and resumed."""

import errno
import os
import pickle
import signal
import subprocess
import sys

import numpy as np
import pytest

import robsim as rs
from robsim.base import atomic_files
from robsim.studies import dask_cluster
from robsim.studies.row_simulator import RowSimulator
from robsim.studies.study_text import format_plan

NOISY = {"sensing.noise": 0.3, "sensing.latency": 0.08}


@pytest.fixture(scope="module")
def noisy(flying):
    return flying.at(NOISY)


@pytest.fixture(scope="module")
def wanted(noisy, how):
    return rs.study(noisy, 12, **how).hash


CUTS = [(chunk, threads) for chunk in (1, 7, 64, 1000) for threads in (1, 2)]


@pytest.mark.parametrize(
    ("chunk", "threads"),
    [pytest.param(*cut, marks=[pytest.mark.full] * (i % 3 == 0)) for i, cut in enumerate(CUTS)],
)
def test_threads_and_chunks_leave_the_bits(noisy, how, wanted, chunk, threads):
    assert rs.study(noisy, 12, chunk=chunk, threads=threads, **how).hash == wanted


def test_a_store_and_its_text_leave_the_bits(noisy, how, wanted, tmp_path):
    stored = rs.study(noisy, 12, store=tmp_path / "a", chunk=25, **how)
    assert stored.hash == wanted == rs.open_study(tmp_path / "a").hash
    path = tmp_path / "again.toml"
    path.write_text(stored.text)
    again = rs.open_study(tmp_path / "a").plan
    assert format_plan(again) == stored.text
    assert stored.table.equals(rs.open_study(tmp_path / "a").table)


def test_a_study_that_was_stopped_goes_on_to_the_same_bits(noisy, how, wanted, tmp_path):
    def stop(share):
        if share > 0.4:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(rs.errors.Interrupted) as error:
        rs.study(noisy, 12, store=tmp_path, chunk=10, threads=1, progress=stop, **how)
    so_far = error.value.run
    assert not so_far.complete and so_far.runs.tolist() == list(range(20))
    with pytest.raises(rs.errors.FileError, match="holds this study already; resume it"):
        rs.study(noisy, 12, store=tmp_path, **how)
    files = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("rows-*")}
    assert rs.study(noisy, 12, store=tmp_path, resume=True, chunk=64, **how).hash == wanted
    assert all((tmp_path / name).stat().st_mtime_ns == when for name, when in files.items())


KILLED = """
import os, signal, sys
import robsim as rs
from robsim.studies import row_files

put, count = row_files.write_whole, 0
def counted(path, data):
    global count
    count += "rows-" in str(path)
    if count == 3:  # in the midst of a file
        draft = str(path.parent / f".robsim-{os.getpid()}-{'0' * 32}")
        open(draft, "wb").write(bytes(data)[:100])
        os.kill(os.getpid(), signal.SIGKILL)
    return put(path, data)
row_files.write_whole = counted
from robsim.cli import main
sys.argv = ["robsim", "study", sys.argv[1], "-o", sys.argv[2], "--chunk", "10"]
main()
"""


def test_a_full_disk_keeps_the_finished_part(noisy, how, wanted, tmp_path, monkeypatch):
    write = atomic_files._write_synced

    def full(path, content):
        if len(list(tmp_path.glob("rows-*"))) == 2:
            path.write_bytes(bytes(content)[:100])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(path, content)

    monkeypatch.setattr(atomic_files, "_write_synced", full)
    with pytest.raises(rs.errors.FileError, match=r"cannot write .*rows-.*No space left on device"):
        rs.study(noisy, 12, store=tmp_path, chunk=10, **how)
    monkeypatch.undo()
    assert rs.open_study(tmp_path).runs.tolist() == list(range(20))
    assert rs.study(noisy, 12, store=tmp_path, resume=True, **how).hash == wanted


@pytest.mark.full  # as a process of its own is started
def test_a_study_that_was_killed_goes_on_to_the_same_bits(noisy, how, wanted, tmp_path, called):
    text = rs.study(noisy, 12, chunk=90, **how).text
    (tmp_path / "s.toml").write_text(text)
    told = [sys.executable, "-c", KILLED, str(tmp_path / "s.toml"), str(tmp_path / "out")]
    done = subprocess.run(told, capture_output=True, timeout=120, check=False)
    assert done.returncode == -signal.SIGKILL
    left = rs.open_study(tmp_path / "out")
    assert left.runs.tolist() == list(range(20))  # of the third part there is nothing
    status, out, _ = called("study", tmp_path / "s.toml", "-o", tmp_path / "out", "--resume")
    assert status == 0 and "36 runs: 12 draws x 3 of task" in out
    assert rs.open_study(tmp_path / "out").hash == wanted
    assert not list((tmp_path / "out").glob(".robsim-*"))  # nor of its draft


def test_trajectories_agree_with_the_runs(noisy, how, tmp_path):
    some = rs.study(noisy, 4, store=tmp_path, trajectories=10, chunk=5, **how)
    ways = some.trajectories()
    for number in (0, 11):
        run = some.replay(number)
        kept = run.q.values[::10]
        found = ways.q.sel(run=number).values
        assert (found[: len(kept)] == kept).all() and len(found) == 11
        own = ways.error_norm.sel(run=number).values[: len(kept)]
        assert (own == run.error_norm.values[::10]).all()
        assert ways.time.values.tolist() == pytest.approx([0.4 * i for i in range(11)])


def test_a_worker_receives_everything_it_needs(noisy, how):
    plan = rs.study(noisy, 12, **how).plan
    work = pickle.dumps(plan)
    there, here = (
        dask_cluster.simulate_chunk(work, dask_cluster.VERSIONS, 5, 20),
        RowSimulator(plan).simulate(5, 20),
    )
    for name, values in here.facts.items():
        np.testing.assert_array_equal(there.facts[name], values)
    with pytest.raises(rs.errors.InputError, match=r"this worker has RobSim .* install the same"):
        dask_cluster.simulate_chunk(work, {"robsim": "0.0", "kernels": "x"}, 5, 20)


@pytest.mark.full
@pytest.mark.filterwarnings("default")  # Dask has warnings of its own
def test_a_cluster_leaves_the_bits_also_where_a_worker_dies(noisy, how, wanted, tmp_path):
    """Two workers in processes of their own; one is killed in mid-run, and its chunk runs again."""
    distributed = pytest.importorskip("distributed")
    killed = []

    def kill(share):
        if share > 0.2 and not killed:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    quiet = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "silence_logs": 50}
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, **quiet) as made,
        dask_cluster.connect_client(made.scheduler_address) as client,
    ):
        assert rs.study(noisy, 12, client=client, chunk=7, **how).hash == wanted
        options = {"client": client, "chunk": 4, "store": tmp_path, "progress": kill}
        assert rs.study(noisy, 12, **options, **how).hash == wanted
        assert killed
