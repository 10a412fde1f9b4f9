"""Files of machine code: whole or not believed, for this processor or not used."""

import pytest
from numba import types

from robsim.kernels import cache, features, gain, prebuilt, store

KEY = ((types.float64, types.Array(types.float64, 2, "C")), ("x86_64", "cpu", "+avx2"), [])
ALL = prebuilt.LEVELS["x86_64"]["x86-64-v4"]


def saved(folder, key=KEY):
    """The file of something saved."""
    store.save(folder, "loop.stride-7", key, {"code": b"machine", "number": 3})
    (path,) = folder.iterdir()
    return path


def test_what_is_saved_is_loaded_and_only_for_its_key(tmp_path):
    path = saved(tmp_path)
    assert store.load(tmp_path, "loop.stride-7", KEY) == {"code": b"machine", "number": 3}
    for other in (
        ((types.float32,), *KEY[1:]),
        (KEY[0], ("x86_64", "cpu", ""), []),
        (*KEY[:2], [1]),
    ):
        assert store.load(tmp_path, "loop.stride-7", other) is None
    assert store.load(tmp_path, "loop.stride-8", KEY) is None
    assert path.stat().st_mode & 0o777 == 0o666 & ~mask(tmp_path)  # others may read it


def mask(folder):
    probe = folder / "probe"
    probe.touch()
    return 0o666 & ~(probe.stat().st_mode & 0o777)


@pytest.mark.parametrize("left", [0, 1, 31, 32, 33, -1])
def test_a_truncated_file_is_as_none(tmp_path, left):
    path = saved(tmp_path)
    path.write_bytes(path.read_bytes()[:left])
    assert store.load(tmp_path, "loop.stride-7", KEY) is None
    saved_again = saved(tmp_path)
    assert saved_again == path and store.load(tmp_path, "loop.stride-7", KEY)["number"] == 3


def test_a_file_in_which_one_bit_is_wrong_is_as_none(tmp_path):
    path = saved(tmp_path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert store.load(tmp_path, "loop.stride-7", KEY) is None


def test_the_file_of_another_key_under_the_same_name_is_as_none(tmp_path):
    path = saved(tmp_path)
    other = (KEY[0], ("arm64", "cpu", ""), [])
    path.rename(tmp_path / store.file_name("loop.stride-7", other))
    assert store.load(tmp_path, "loop.stride-7", other) is None


def test_a_folder_that_cannot_be_is_an_error_and_leaves_nothing(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OSError):
        store.save(tmp_path / "file", "loop.stride-7", KEY, 1)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_free_variables_of_a_kernel_count_by_what_they_are():
    def made(factor):
        def scaled(x):
            return factor * x

        return cache.KernelCache(scaled)

    assert made(2.0).free == made(2.0).free != made(3.0).free
    by_kernel = made(features.points_interaction).free
    assert by_kernel == made(features.points_interaction).free != made(gain.adaptive).free
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


def test_what_came_for_other_versions_is_told(monkeypatch, tmp_path):
    monkeypatch.setattr(prebuilt, "ROOT", tmp_path)
    monkeypatch.setattr(prebuilt, "FOLDER", None)
    assert prebuilt.why_not() == ""  # nothing came
    (tmp_path / prebuilt.MADE_WITH).write_text("Numba 0.1, llvmlite 0.2, Python 3.3")
    assert prebuilt.why_not() == (
        "those that came with the package are for Numba 0.1, llvmlite 0.2, Python 3.3, "
        f"this is {store.VERSIONS}"
    )
    (tmp_path / prebuilt.MADE_WITH).write_text(store.VERSIONS)
    assert "other sources" in prebuilt.why_not()
    (tmp_path / store.KERNEL_HASH).mkdir()
    assert "other processors" in prebuilt.why_not()
    monkeypatch.setattr(prebuilt, "FOLDER", tmp_path)
    assert prebuilt.why_not() == ""
