"""Archives of machine code: the same bytes from the same code, and whole or not believed."""

import lzma

import numpy as np
import pytest

from robsim.kernels.machine import code_archive
from robsim.kernels.machine.code_archive import CodeArchive, pack_archive, unpack_archive
from robsim.kernels.machine.machine_code import USES_NUMBA, PackageCode
from robsim.kernels.machine.sources import digest_of_all

KERNELS = digest_of_all()
REFUSED = (ValueError, lzma.LZMAError)


def build_archive(order=1):
    """An archive of three functions, one of them empty; the order of the parts may be reversed."""
    rng = np.random.default_rng(1)
    parts = {"robsim.b": rng.bytes(3000), "robsim.a": b"\n\0code\n" * 90, "robsim.c": b""}
    needs = {"robsim.a": ["robsim.b", "robsim.fail"], "robsim.b": [], "robsim.c": []}
    pairs = [dict(list(each.items())[::order]) for each in (parts, needs)]
    return CodeArchive(KERNELS, 15, *pairs)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder of the archives of a package."""
    monkeypatch.setattr(code_archive, "FOLDER", tmp_path)
    monkeypatch.delenv(USES_NUMBA, raising=False)
    monkeypatch.delenv("NUMBA_BOUNDSCHECK", raising=False)
    return tmp_path


def test_an_archive_comes_back_and_its_bytes_do_not_depend_on_an_order():
    archive = build_archive()
    content = pack_archive(archive)
    assert unpack_archive(content) == archive
    assert pack_archive(unpack_archive(content)) == content == pack_archive(build_archive(-1))


@pytest.mark.parametrize("left", [0, 1, 31, 32, 33, -1])
def test_a_truncated_archive_is_refused(folder, left):
    content = pack_archive(build_archive())[:left]
    with pytest.raises(REFUSED):
        unpack_archive(content)
    (folder / "bitcode.lzma").write_bytes(content)
    assert code_archive.read_archive("bitcode", KERNELS) is None


@pytest.mark.parametrize("seed", range(20))
def test_an_archive_in_which_one_bit_is_wrong_is_refused(folder, seed):
    content = bytearray(pack_archive(build_archive()))
    at, bit = np.random.default_rng(seed).integers([len(content), 8])
    content[at] ^= 1 << bit
    with pytest.raises(REFUSED):
        unpack_archive(bytes(content))
    (folder / "bitcode.lzma").write_bytes(content)
    assert code_archive.read_archive("bitcode", KERNELS) is None


def test_an_archive_is_for_the_sources_that_it_was_made_from(folder):
    assert code_archive.read_archive("bitcode", KERNELS) is None  # there is none
    (folder / "bitcode.lzma").write_bytes(pack_archive(build_archive()))
    assert code_archive.read_archive("bitcode", KERNELS) == build_archive()
    assert code_archive.read_archive("bitcode", "0" * len(KERNELS)) is None
    assert code_archive.read_archive("x86-64-v3", KERNELS) is None


def test_code_that_is_not_used_is_explained(folder, monkeypatch):
    assert "damaged or of other sources" in code_archive.explain_mismatch(KERNELS)
    (folder / "bitcode.lzma").write_bytes(pack_archive(build_archive()))
    assert code_archive.explain_mismatch(KERNELS) == ""
    assert "damaged or of other sources" in code_archive.explain_mismatch("0" * len(KERNELS))
    monkeypatch.setattr(code_archive, "FOLDER", folder / "none")
    assert code_archive.explain_mismatch(KERNELS) == ""  # the package came without


@pytest.mark.parametrize("variable", [USES_NUMBA, "NUMBA_BOUNDSCHECK"])
def test_a_variable_asks_for_the_code_of_numba(folder, monkeypatch, variable):
    (folder / "bitcode.lzma").write_bytes(pack_archive(build_archive()))
    assert PackageCode().bitcode == build_archive()
    monkeypatch.setenv(variable, "1")
    assert PackageCode().bitcode is None and PackageCode().objects is None


def test_a_function_is_loaded_if_all_its_symbols_are_known(folder):
    """One needs a symbol that no stage has, and the archive does not have the other."""
    archive = CodeArchive(KERNELS, 15, {"robsim.a": b"BC"}, {"robsim.a": ["robsim.no_such_stage"]})
    (folder / "bitcode.lzma").write_bytes(pack_archive(archive))
    code = PackageCode()
    assert code.find("robsim.a") == code.find("robsim.b") == 0


def test_bitcode_of_a_later_llvm_is_left_to_numba(folder):
    archive = CodeArchive(KERNELS, 99, {"robsim.a": b"BC"}, {"robsim.a": ["robsim.fail"]})
    (folder / "bitcode.lzma").write_bytes(pack_archive(archive))
    assert PackageCode().find("robsim.a") == 0
