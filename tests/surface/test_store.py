"""Files of machine code: whole or not believed, for this processor or not used."""

import errno
import os
import time

import pytest
from numba import types

from robsim.kernels.formulas import adaptive_gain, interaction
from robsim.kernels.machine import cache, cache_files, prebuilt

KEY = ((types.float64, types.Array(types.float64, 2, "C")), ("x86_64", "cpu", "+avx2"), [])
ALL = prebuilt.LEVELS["x86_64"]["x86-64-v4"]


def saved(folder, key=KEY):
    """The file of something saved."""
    cache_files.save_code(folder, "loop.stride-7", key, {"code": b"machine", "number": 3})
    (path,) = folder.iterdir()
    return path


def test_saved_code_is_loaded_and_only_for_its_key(tmp_path):
    path = saved(tmp_path)
    assert cache_files.load_code(tmp_path, "loop.stride-7", KEY) == {
        "code": b"machine",
        "number": 3,
    }
    for other in (
        ((types.float32,), *KEY[1:]),
        (KEY[0], ("x86_64", "cpu", ""), []),
        (*KEY[:2], [1]),
    ):
        assert cache_files.load_code(tmp_path, "loop.stride-7", other) is None
    assert cache_files.load_code(tmp_path, "loop.stride-8", KEY) is None
    assert path.stat().st_mode & 0o777 == 0o666 & ~mask(tmp_path)  # others may read it


def mask(folder):
    probe = folder / "probe"
    probe.touch()
    return 0o666 & ~(probe.stat().st_mode & 0o777)


@pytest.mark.parametrize("left", [0, 1, 31, 32, 33, -1])
def test_a_truncated_file_is_refused(tmp_path, left):
    path = saved(tmp_path)
    path.write_bytes(path.read_bytes()[:left])
    with pytest.raises(ValueError, match=r"cut short|was changed"):
        cache_files.load_code(tmp_path, "loop.stride-7", KEY)
    saved_again = saved(tmp_path)
    assert (
        saved_again == path and cache_files.load_code(tmp_path, "loop.stride-7", KEY)["number"] == 3
    )


def test_a_file_in_which_one_bit_is_wrong_is_refused(tmp_path):
    path = saved(tmp_path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"cut short|was changed"):
        cache_files.load_code(tmp_path, "loop.stride-7", KEY)


def test_the_file_of_another_key_or_kernel_under_the_same_name_is_refused(tmp_path):
    """All stages have one signature, so that their files would else stand for each other."""
    path = saved(tmp_path)
    other = (KEY[0], ("arm64", "cpu", ""), [])
    for name, key in (("loop.stride-7", other), ("loop.settle-9", KEY)):
        path = path.rename(tmp_path / cache_files.code_file_name(name, key))
        with pytest.raises(ValueError, match="belongs to another kernel"):
            cache_files.load_code(tmp_path, name, key)


def test_a_folder_that_cannot_be_is_an_error_and_leaves_nothing(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OSError):
        cache_files.save_code(tmp_path / "file", "loop.stride-7", KEY, 1)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_damaged_file_of_the_user_goes_and_one_of_the_package_stays(tmp_path, monkeypatch):
    path = saved(tmp_path / "own")
    cache_files.drop_code(tmp_path / "own", "loop.stride-7", KEY)
    assert path.exists()
    monkeypatch.setattr(cache_files, "CACHE", tmp_path / "own")
    cache_files.drop_code(tmp_path / "own", "loop.stride-7", KEY)
    assert not path.exists()
    cache_files.drop_code(tmp_path / "own", "loop.stride-7", KEY)  # another process was faster


def test_a_full_disk_leaves_no_draft(tmp_path, monkeypatch):
    def full(self, content):
        self.touch()
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(cache_files, "CACHE", tmp_path)
    monkeypatch.setattr(cache_files.Path, "write_bytes", full)
    assert not cache_files.is_cache_writable()
    with pytest.raises(OSError, match="No space"):
        cache_files.save_code(tmp_path, "loop.stride-7", KEY, 1)
    assert list(tmp_path.iterdir()) == []


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
    monkeypatch.setattr(prebuilt.platform, "machine", lambda: "AMD64")
    monkeypatch.setattr(
        prebuilt.llvm,
        "get_host_cpu_features",
        lambda: dict.fromkeys(ALL, False) | dict.fromkeys(have, True),
    )
    assert prebuilt.levels() == levels


def test_an_arm_processor_has_one_level_and_others_have_none(monkeypatch):
    for machine, levels in {"arm64": ["generic"], "riscv64": []}.items():
        monkeypatch.setattr(prebuilt.platform, "machine", lambda machine=machine: machine)
        assert prebuilt.levels() == levels


def test_kernels_of_other_versions_are_reported(monkeypatch, tmp_path):
    monkeypatch.setattr(prebuilt, "ROOT", tmp_path)
    monkeypatch.setattr(prebuilt, "FOLDER", None)
    assert prebuilt.explain_mismatch() == ""  # nothing came
    made = tmp_path / prebuilt.MADE_WITH
    made.write_text(f"Numba 0.1, llvmlite 0.2, Python 3.3\n{cache_files.KERNEL_HASH}\n")
    assert prebuilt._find_prebuilt_folder() == (None, "")
    assert prebuilt.explain_mismatch() == (
        "the precompiled kernels are for Numba 0.1, llvmlite 0.2, Python 3.3, "
        f"this is {cache_files.VERSIONS}"
    )
    made.write_text(f"{cache_files.VERSIONS}\n0123456789abcdef\n")
    assert "other sources" in prebuilt.explain_mismatch()
    made.write_text(f"{cache_files.VERSIONS}\n{cache_files.KERNEL_HASH}\n")
    assert "other processors" in prebuilt.explain_mismatch()
    monkeypatch.setattr(prebuilt, "FOLDER", tmp_path)
    assert prebuilt.explain_mismatch() == ""
