"""The cost of bags and run files beside the least that their formats allow.

Bags stand beside rosbags alone and the bytes of mcap, run files beside h5netcdf through xarray.

Needs `pip install 'robsim[ros]' mcap`. Ratios are of seconds, the least of some turns each.
"""

import tempfile
import time
from pathlib import Path

import mcap.reader
import numpy as np
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

import robsim as rs
from robsim.logs import message_types
from robsim.logs.run_messages import generate_messages

TURNS = 3
INSTANTS = 2500


def least(call, clock=time.perf_counter):
    """The least seconds of some turns."""
    found = []
    for _ in range(TURNS):
        begin = clock()
        call()
        found.append(clock() - begin)
    return min(found)


def plainly_written(words, path):
    """Serialise and write messages that are there already, by rosbags alone."""
    store, topics = message_types.load_typestore(), {}
    with Writer(path, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, kind, now, message in words:
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(topics[topic], now, store.serialize_cdr(message, kind))


def plainly_read(path):
    """Read and deserialise every message by rosbags alone."""
    store = message_types.load_typestore()
    with Reader(path) as reader:
        for connection, _, data in reader.messages():
            store.deserialize_cdr(data, connection.msgtype)


def bytes_read(path):
    """Read the bytes of every message by mcap alone."""
    with open(path, "rb") as file:
        for _ in mcap.reader.make_reader(file).iter_messages():
            pass


def measure_run_files(runs=300):
    """Least seconds of CPU to save runs and one run, as a checked file and by xarray alone."""
    experiment = rs.load_scenario(rs.examples.path("chapter_6_1"))
    starts = np.repeat(experiment.scene.home[None], runs, axis=0)
    each = {
        f"save {runs} runs": experiment.with_(start=starts, hold=True).run(),
        "save one run": experiment.run(),
    }
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        file, plain = Path(folder) / "run.nc", Path(folder) / "plain.nc"
        for name, run in each.items():
            ours = least(lambda run=run: rs.save_run(run, file), time.process_time)
            theirs = least(
                lambda run=run: run.to_netcdf(plain, engine="h5netcdf"), time.process_time
            )
            found[name] = ours, theirs, file.stat().st_size / 1e6
    return found


def main():
    """Print the tables."""
    for name, (ours, theirs, size) in measure_run_files().items():
        print(
            f"{name:16}{size:6.1f} MB {ours:7.3f} s, {size / ours:5.0f} MB/s; "
            f"xarray alone {theirs:7.3f} s, {size / theirs:5.0f} MB/s"
        )
    experiment = rs.load_scenario(rs.examples.path("chapter_6_1")).with_(dt=0.002)
    run = experiment.run(duration=0.002 * INSTANTS, hold=True)
    store = message_types.load_typestore()
    words = [
        (topic, kind, time, store.deserialize_cdr(data, kind))
        for topic, kind, time, data in generate_messages(run, experiment, 0)
    ]
    with tempfile.TemporaryDirectory() as folder:
        file, turns = Path(folder) / "run.mcap", iter(range(TURNS))
        write = least(lambda: rs.logs.write_bag(run, file))
        plain = least(lambda: plainly_written(words, Path(folder) / f"plain{next(turns)}"))
        read = least(lambda: rs.logs.read_bag(file, experiment))
        decoded = least(lambda: plainly_read(file))
        raw = least(lambda: bytes_read(file))
        size = file.stat().st_size
    print(f"{len(run.time)} instants, {len(words)} messages, {size / 1e6:.1f} MB")
    print(f"{'':22}{'robsim, s':>11}{'alone, s':>10}{'ratio':>7}")
    for name, ours, theirs in (
        ("write, by rosbags", write, plain),
        ("read, by rosbags", read, decoded),
        ("read, bytes by mcap", read, raw),
    ):
        print(f"{name:22}{ours:11.3f}{theirs:10.3f}{ours / theirs:7.2f}")


if __name__ == "__main__":
    main()
