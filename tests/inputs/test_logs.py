"""Refused logs, each with one line that names the place."""

import builtins

import numpy as np
import pytest

import robsim as rs
from robsim.logs import message_types
from robsim.run.log import Stream

RHINO = rs.load_scenario(rs.examples.path("chapter_6_1")).with_(duration=0.6)


@pytest.fixture(scope="module")
def run():
    return RHINO.run()


@pytest.fixture
def rows(run):
    return rs.logs.to_table(run)


def put(table, row, column, value):
    table[column] = table[column].astype(object if isinstance(value, str) else float)
    table.loc[row, column] = value
    return table


TABLES = {
    "no joints": (lambda t: t.drop(columns="q[wrist]"), r"no column q\[wrist\], which q needs"),
    "a name": (
        lambda t: t.rename(columns={"q[wrist]": "q[wirst]"}), r"no column q\[wrist\]",
    ),
    "no time": (lambda t: t.drop(columns="time"), "no column time"),
    "no pixels": (
        lambda t: t.drop(columns="pixels[3,row]"), r"no column pixels\[3,row\], which pixels of",
    ),
    "half the commands": (
        lambda t: t.drop(columns="qd[tool]"), r"no column qd\[tool\], which qd needs",
    ),
    "backwards": (
        lambda t: put(t, 5, "time", 0.1), r"the clock goes backwards, to 0.1 s after 0.16 s",
    ),
    "no number": (lambda t: put(t, 5, "q[tool]", "x"), r"column q\[tool\]: could not convert"),
    "infinite": (lambda t: put(t, 5, "q[tool]", np.inf), r"column q\[tool\]: inf in row 5"),
    "a joint lacks": (
        lambda t: put(t, 5, "q[tool]", np.nan), r"column q\[tool\]: empty in row 5, but other",
    ),
    "no such time": (lambda t: put(t, 5, "time", np.nan), "nan in row 5 is not a time in seconds"),
    "nanoseconds": (
        lambda t: t.assign(time=t.time * 1e9 + 1.7e18), "in row 0 is not a time in seconds",
    ),
    "a mark": (
        lambda t: t.assign(**{"pixels[1,row]": np.nan}), "mark 1 was never seen",
    ),
    "nothing": (lambda t: t.iloc[:0], "nothing was recorded"),
    "one row": (lambda t: t.iloc[:1], r"known for 0 s, which is less than a period of 0.04 s"),
    "two runs": (lambda t: t.assign(run=np.arange(len(t)) % 2), "table has 2 runs; a log has one"),
    "a jump": (
        lambda t: t.assign(time=t.time + 1e3 * (t.index > 4)), r"nothing between 0.16 s and 1000.2",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", TABLES)
def test_a_table_that_is_no_log(case, rows, tmp_path):
    change, words = TABLES[case]
    change(rows).to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(rs.errors.FileError, match=words) as raised:
        rs.logs.read_log(tmp_path / "log.csv", RHINO)
    assert str(raised.value).startswith(f"{tmp_path / 'log.csv'}: ")
    assert "\n" not in str(raised.value)


def test_a_file_that_is_no_table(tmp_path):
    for name, content, words in (
        ("gone.csv", None, "no file"),
        ("log.txt", b"time", "expected a .csv or .parquet file"),
        ("empty.csv", b"", "cannot be read as a table"),
        ("bytes.csv", b"\xff\xfe\x00a,b\n1", "cannot be read as a table|no column time"),
        ("log.parquet", b"PAR1", "cannot be read as a table"),
        ("ragged.csv", b"time,q\n1,2\n1,2,3,4\n", "cannot be read as a table"),
    ):
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(rs.errors.FileError, match=words):
            rs.logs.read_log(tmp_path / name, RHINO)
    with pytest.raises(rs.errors.FileError, match=r"cannot read None"):
        rs.logs.read_log(None, RHINO)


def test_rows_that_are_no_log():
    for rows, words in (
        ([], "rows: nothing was recorded"),
        ([{"time": 0.0}, 3], r"rows: expected \{column: number\}, got 3 in row 1"),
        ([{"time": 0.0}], r"rows: no column q\[shoulder\], which q needs"),
        ([{"time": "soon"}], "rows: column time: could not convert"),
    ):
        with pytest.raises(rs.errors.FileError, match=words):
            rs.logs.read_log(rows, RHINO)


@pytest.mark.parametrize(
    ("name", "reader"),
    [
        ("a.mcap", r"rs\.logs\.read_bag\(path\)"),
        ("a.db3", r"rs\.logs\.read_bag\(path\)"),
        ("a.CSV", r"rs\.logs\.read_log\(path, experiment\)"),
        ("a.parquet", r"rs\.logs\.read_log\(path, experiment\)"),
    ],
)
def test_the_error_for_a_log_opened_as_a_run_names_the_right_function(name, reader, tmp_path):
    (tmp_path / name).write_text("time,q\n0,1\n")
    words = f"is not a NetCDF-4 file; {reader} makes a run of such a log, and save_run its run.nc"
    with pytest.raises(rs.errors.FileError, match=words):
        rs.open_run(tmp_path / name)


def test_arguments_that_are_wrong(rows):
    for how, words in (
        ({"columns": {"q[wirst]": "time"}}, r"no column 'q\[wirst\]' in a run; did you mean"),
        ({"columns": {"q[wrist]": "wrist"}}, r"no column 'wrist'; "),
        ({"columns": 3}, "columns: expected"),
        ({"units": {"q": "m"}}, r"units of q\[shoulder\]: 'm': expected a unit of angle: rad, deg"),
        ({"units": {"speed": "m"}}, "units: no column 'speed'"),
        ({"units": {"pixels": "px"}}, r"units: pixels\[0,column\] is in px"),
        ({"units": 3}, "units: expected"),
    ):
        with pytest.raises(rs.errors.InputError, match=words):
            rs.logs.read_log(rows, RHINO, **how)
    with pytest.raises(rs.errors.InputError, match="expected an Experiment"):
        rs.logs.read_log(rows, None)
    mission = rs.load_scenario(rs.examples.path("inspection_a"))
    with pytest.raises(rs.errors.InputError, match="mission"):
        rs.logs.read_log(rows, mission)


def test_a_run_that_was_recorded_is_not_simulated_again(run, rows):
    log = rs.logs.read_log(rows, RHINO)
    with pytest.raises(rs.errors.InputError, match="this run was recorded: use explain or replay"):
        rs.diagnose(log)
    with pytest.raises(rs.errors.InputError, match=r"from a log has no diagnosis; use rs\.explain"):
        rs.plot.diagnosis(log)
    with pytest.raises(rs.errors.InputError, match=r"scheme 'a': expected a recorded run"):
        rs.compare({"a": run})


def test_without_pyarrow_the_error_names_the_package_to_install(tmp_path, monkeypatch):
    def lacks(*_, **__):
        raise ImportError("Missing optional dependency 'pyarrow'")

    monkeypatch.setattr("pandas.read_parquet", lacks)
    (tmp_path / "log.parquet").write_bytes(b"PAR1")
    with pytest.raises(rs.errors.InputError, match=r"PyArrow: pip install 'robsim\[store\]'"):
        rs.logs.read_log(tmp_path / "log.parquet", RHINO)


def test_without_rosbags_the_error_names_the_package_to_install(run, tmp_path, monkeypatch):
    there = builtins.__import__

    def without(name, *more, **named):
        if name.split(".")[0] == "rosbags":
            raise ImportError(name)
        return there(name, *more, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    message_types.load_typestore.cache_clear()
    bag = tmp_path / "there.mcap"
    bag.touch()
    for call in (
        lambda: rs.logs.write_bag(run, tmp_path / "bag"),
        lambda: rs.logs.read_bag(bag),
        lambda: next(rs.logs.read_bag_images(bag, "/image")),
        lambda: rs.control.RosMessages(rs.Controller(RHINO)).command([0.0] * 5),
    ):
        with pytest.raises(
            rs.errors.InputError, match=r"needs rosbags: pip install 'robsim\[ros\]'"
        ):
            call()
    assert list(tmp_path.iterdir()) == [bag]
    message_types.load_typestore.cache_clear()


def test_the_clock_of_a_stream_its_last_and_its_nearest_value():
    times, asked = np.array([0, 10, 10, 30]), np.array([-1, 0, 9, 10, 20, 21, 30, 99])
    stream = Stream("a", times, np.arange(1.0, 5.0)[:, None])
    last = stream.index(asked)
    np.testing.assert_array_equal(last, [-1, 0, 0, 2, 2, 2, 3, 3])
    np.testing.assert_array_equal(stream.take(last)[:, 0], [0, 1, 1, 3, 3, 3, 4, 4])
    np.testing.assert_array_equal(stream.nearest(asked), [0, 0, 2, 2, 2, 3, 3, 3])
    assert (stream.find_step(99.0), stream.find_step(7.0)) == (15.0, 7.0)
    with pytest.raises(rs.errors.FileError, match="nothing was recorded"):
        Stream("a", times[:0], np.empty((0, 1)))
