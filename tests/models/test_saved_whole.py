"""Files are written whole or not at all, and stay what they are: links, pipes, permissions."""

import errno
import os
import stat
import tempfile
import threading

import pytest

import pycraft as pc
from pycraft.models.writers.save import write_text


@pytest.fixture
def arm():
    return pc.chain(2)


class Full:
    """A file on a disk that is full: some of it is written, and then no more."""

    def __init__(self, number, mode):
        self.number = number

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.number)

    def write(self, content):
        os.write(self.number, content[:10])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("there", [True, False])
def test_a_full_disk_leaves_what_was_there(arm, tmp_path, monkeypatch, there):
    path = tmp_path / "arm.toml"
    if there:
        path.write_bytes(b"the work of a year")
    monkeypatch.setattr(os, "fdopen", Full)
    with pytest.raises(pc.ModelError, match=r"arm\.toml: cannot be written: No space left on device"):
        arm.save(path)
    assert [one.name for one in tmp_path.iterdir()] == ["arm.toml"] * there
    assert not there or path.read_bytes() == b"the work of a year"


def test_text_that_no_file_holds_leaves_what_was_there(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_bytes(b"the work of a year")
    with pytest.raises(pc.ModelError, match=r"arm\.toml': cannot be written: .*surrogates not allowed"):
        write_text(str(path), "half of \ud83d")
    assert path.read_bytes() == b"the work of a year"


def test_permissions_stay(arm, tmp_path):
    fresh, kept = tmp_path / "fresh.toml", tmp_path / "kept.toml"
    (tmp_path / "plain").touch()
    arm.save(fresh)
    assert fresh.stat().st_mode == (tmp_path / "plain").stat().st_mode
    kept.touch()
    kept.chmod(0o640)
    arm.save(kept)
    assert stat.S_IMODE(kept.stat().st_mode) == 0o640 and kept.read_bytes() == fresh.read_bytes()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everything")
def test_what_may_not_be_written_is_refused(arm, tmp_path):
    path = tmp_path / "kept.toml"
    path.touch(mode=0o444)
    with pytest.raises(pc.ModelError, match="cannot be written: Permission denied"):
        arm.save(path)
    assert path.read_bytes() == b""


def test_a_folder_that_takes_no_file_and_a_file_that_may_be_written(arm, tmp_path, monkeypatch):
    path = tmp_path / "arm.toml"
    path.write_text("old")
    monkeypatch.setattr(os, "access", lambda folder, mode: os.fspath(folder) != os.path.realpath(tmp_path))
    monkeypatch.setattr(tempfile, "mkstemp", None)  # nothing beside it
    arm.save(path)
    assert pc.load(path).nv == 2


def test_a_symbolic_link_stays_one(arm, tmp_path):
    (tmp_path / "there").mkdir()
    real, link = tmp_path / "there" / "real.toml", tmp_path / "link.toml"
    link.symlink_to(real)
    for _ in range(2):  # one that leads nowhere yet, and one that leads to a file
        arm.save(link)
        assert link.is_symlink() and pc.load(real).nv == 2
    assert sorted(one.name for one in tmp_path.rglob("*")) == ["link.toml", "real.toml", "there"]


def test_a_pipe_stays_one(arm, tmp_path):
    pipe, plain, read = tmp_path / "pipe.toml", tmp_path / "plain.toml", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()), daemon=True)
    reader.start()
    arm.save(pipe)
    arm.save(plain)
    reader.join(10)
    assert read == [plain.read_bytes()] and stat.S_ISFIFO(pipe.stat().st_mode)


def test_a_name_of_a_file_that_is_no_text(arm, tmp_path):
    """Names of files are bytes, and some are none of UTF-8."""
    path = os.fsencode(tmp_path) + b"/caf\xe9.toml"
    arm.save(path)
    assert pc.load(path).nv == 2
