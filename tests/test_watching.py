"""The viewer comes up while the recording is read, and goes again if there is nothing to show."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from cli.main import run
from cli.watching import Watch
from sonarlog.viz import native


class Process:
    ended = False

    def terminate(self) -> None:
        self.ended = True


def test_a_window_with_nothing_in_it_is_closed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    process = Process()
    monkeypatch.setattr(native, "require_display", lambda: None)
    monkeypatch.setattr(native, "start_viewer", lambda: SimpleNamespace(process=process))
    with pytest.raises(OSError, match="not to be read"), Watch(lambda _done, _count: None, "window", "title"):
        raise OSError("not to be read")
    assert process.ended


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there always is one")
def test_without_a_display_it_is_said_before_anything_is_read(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    (tmp_path / "some.mcap").write_bytes(b"not looked at")
    assert run(["replay", str(tmp_path / "some.mcap"), "--viz"]) == 2
    assert "no display" in capsys.readouterr().err
