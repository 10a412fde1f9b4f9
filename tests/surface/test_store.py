"""Files of machine code: whole or not believed, for this processor or not used."""

import errno
import os
import time

import pytest
from llvmlite import binding
from numba import types

from robsim.kernels.formulas import adaptive_gain, interaction
from robsim.kernels.machine import cache_files, processor_levels
from robsim.kernels.machine.compiler import cache

KEY = ((types.float64, types.Array(types.float64, 2, "C")), ("x86_64", "cpu", "+avx2"), [])
ALL = processor_levels.LEVELS["x86-64-v4"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """The folder of the files, which is not there yet."""
    monkeypatch.setattr(cache_files, "CACHE", tmp_path / "kernels")
    return tmp_path / "kernels"


def saved(folder, key=KEY):
    """The file of something saved."""
    cache_files.save_code("loop.stride-7", key, {"code": b"machine", "number": 3})
    (path,) = folder.iterdir()
    return path


def test_saved_code_is_loaded_and_only_for_its_key(folder):
    path = saved(folder)
    found = {"code": b"machine", "number": 3}
    assert cache_files.load_code("loop.stride-7", KEY) == found
    assert {path.name} <= cache_files.SAVED
    for other in (
        ((types.float32,), *KEY[1:]),
        (KEY[0], ("x86_64", "cpu", ""), []),
        (*KEY[:2], [1]),
    ):
        assert cache_files.load_code("loop.stride-7", other) is None
    assert cache_files.load_code("loop.stride-8", KEY) is None
    assert path.stat().st_mode & 0o777 == 0o666 & ~mask(folder)  # others may read it


def mask(folder):
    probe = folder / "probe"
    probe.touch()
    return 0o666 & ~(probe.stat().st_mode & 0o777)


@pytest.mark.parametrize("left", [0, 1, 31, 32, 33, -1])
def test_a_truncated_file_is_refused(folder, left):
    path = saved(folder)
    path.write_bytes(path.read_bytes()[:left])
    with pytest.raises(ValueError, match=r"cut short|was changed"):
        cache_files.load_code("loop.stride-7", KEY)
    saved_again = saved(folder)
    assert saved_again == path and cache_files.load_code("loop.stride-7", KEY)["number"] == 3


def test_a_file_in_which_one_bit_is_wrong_is_refused(folder):
    path = saved(folder)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"cut short|was changed"):
        cache_files.load_code("loop.stride-7", KEY)


def test_the_file_of_another_key_or_kernel_under_the_same_name_is_refused(folder):
    """All stages have one signature, so that their files would else stand for each other."""
    path = saved(folder)
    other = (KEY[0], ("arm64", "cpu", ""), [])
    for name, key in (("loop.stride-7", other), ("loop.settle-9", KEY)):
        path = path.rename(folder / cache_files.code_file_name(name, key))
        with pytest.raises(ValueError, match="belongs to another kernel"):
            cache_files.load_code(name, key)


def test_a_folder_that_cannot_be_is_an_error_and_leaves_nothing(folder, tmp_path):
    folder.touch()
    with pytest.raises(OSError):
        cache_files.save_code("loop.stride-7", KEY, 1)
    cache_files.write_object("loop.stride", KEY, b"machine")  # a later process translates it again
    assert cache_files.load_code("loop.stride-7", KEY) is None
    assert cache_files.read_object("loop.stride", KEY) is None
    assert [path.name for path in tmp_path.iterdir()] == ["kernels"]


def test_a_damaged_file_goes(folder):
    path = saved(folder)
    cache_files.drop_code("loop.stride-7", KEY)
    assert not path.exists()
    cache_files.drop_code("loop.stride-7", KEY)  # another process was faster


def test_translated_bitcode_comes_back_and_only_for_its_key(folder):
    cache_files.write_object("loop.stride", KEY, b"machine")
    assert cache_files.read_object("loop.stride", KEY) == b"machine"
    assert cache_files.read_object("loop.stride", (*KEY[:2], [1])) is None
    assert cache_files.read_object("loop.settle", KEY) is None
    (path,) = folder.iterdir()
    assert {path.name} <= cache_files.SAVED
    path.rename(folder / cache_files.code_file_name("loop.settle", KEY))
    assert cache_files.read_object("loop.settle", KEY) is None  # of another function


@pytest.mark.parametrize("left", [0, 1, 31, 32, 33, -1])
def test_truncated_bitcode_is_translated_again(folder, left):
    cache_files.write_object("loop.stride", KEY, b"machine")
    (path,) = folder.iterdir()
    path.write_bytes(path.read_bytes()[:left])
    assert cache_files.read_object("loop.stride", KEY) is None
    cache_files.write_object("loop.stride", KEY, b"machine")
    assert cache_files.read_object("loop.stride", KEY) == b"machine"


def test_a_full_disk_leaves_no_draft(folder, monkeypatch):
    def full(self, content):
        self.touch()
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(cache_files.Path, "write_bytes", full)
    assert not cache_files.is_cache_writable()
    with pytest.raises(OSError, match="No space"):
        cache_files.save_code("loop.stride-7", KEY, 1)
    cache_files.write_object("loop.stride", KEY, b"machine")
    assert list(folder.iterdir()) == []


OLD, YOUNG = 31 * cache.DAY, 29 * cache.DAY


def put(path, age=OLD):
    """A file that was used last some time ago."""
    path.write_text("")
    then = time.time() - age
    os.utime(path, (then, then))
    return path


def names(folder):
    return sorted(each.name for each in folder.iterdir())


def test_files_that_nobody_used_for_a_month_go_and_foreign_files_stay(tmp_path):
    put(tmp_path / "old.nbc")
    put(tmp_path / "young.nbc", YOUNG)
    put(tmp_path / "mine.txt")
    (tmp_path / "folder.nbc").mkdir()
    (tmp_path / "link.nbc").symlink_to(tmp_path / "mine.txt")
    cache.clear_old_files(tmp_path)
    assert names(tmp_path) == ["folder.nbc", "link.nbc", "mine.txt", "used", "young.nbc"]


def test_a_file_that_is_loaded_is_as_young_as_that_day(tmp_path):
    used, other = put(tmp_path / "used.nbc"), put(tmp_path / "other.nbc")
    now, today = time.time(), put(tmp_path / "today.nbc", 100.0).stat().st_mtime
    for path in (used, tmp_path / "today.nbc", tmp_path / "none.nbc"):
        cache.note_use(path)
    assert abs(used.stat().st_mtime - now) < 100.0
    assert (tmp_path / "today.nbc").stat().st_mtime == today  # written once a day at most
    cache.clear_old_files(tmp_path)
    assert not other.exists() and names(tmp_path) == ["today.nbc", "used", "used.nbc"]


def test_drafts_of_killed_processes_go_and_a_folder_is_looked_at_once_a_day(tmp_path):
    put(tmp_path / "killed.tmp"), put(tmp_path / "writing.tmp", 10.0)
    cache.clear_old_files(tmp_path)
    assert names(tmp_path) == ["used", "writing.tmp"]
    again = put(tmp_path / "again.tmp")
    cache.clear_old_files(tmp_path)
    assert again.exists()
    put(tmp_path / "used", 2 * cache.DAY)
    cache.clear_old_files(tmp_path)
    assert not again.exists()
    cache.clear_old_files(tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_free_variables_of_a_kernel_count_by_their_values():
    def made(factor):
        def scaled(x):
            return factor * x

        return cache.KernelCache(scaled)

    assert made(2.0).free == made(2.0).free != made(3.0).free
    by_kernel = made(interaction.points_interaction).free
    assert (
        by_kernel
        == made(interaction.points_interaction).free
        != made(adaptive_gain.compute_gains).free
    )
    assert "0x" not in by_kernel[0]


@pytest.mark.parametrize(
    ("have", "levels"),
    [
        (ALL, ["x86-64-v4", "x86-64-v3"]),
        (ALL - {"avx512vl"}, ["x86-64-v3"]),
        (ALL - {"avx2"}, []),
        (set(), []),
    ],
)
def test_the_features_of_a_processor_give_its_levels(monkeypatch, have, levels):
    features = dict.fromkeys(ALL, False) | dict.fromkeys(have, True)
    monkeypatch.setattr(processor_levels.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(processor_levels.sys, "platform", "linux")
    monkeypatch.setattr(binding, "get_host_cpu_features", lambda: features)
    assert processor_levels.find_levels() == levels


def test_an_llvm_that_reports_no_features_has_no_level(monkeypatch):
    def fail():
        raise RuntimeError("unsupported")

    monkeypatch.setattr(processor_levels.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(processor_levels.sys, "platform", "linux")
    monkeypatch.setattr(binding, "get_host_cpu_features", fail)
    assert processor_levels.find_levels() == []


@pytest.mark.parametrize(
    "system", [("linux", "aarch64"), ("linux", "riscv64"), ("darwin", "x86_64"), ("win32", "AMD64")]
)
def test_other_systems_and_processors_have_bitcode_only(monkeypatch, system):
    monkeypatch.setattr(processor_levels.sys, "platform", system[0])
    monkeypatch.setattr(processor_levels.platform, "machine", lambda: system[1])
    assert processor_levels.find_levels() == []
