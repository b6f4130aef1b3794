"""The session alone, packet by packet: what it sends when, and when it gives up."""

import pytest

from sonarlog.protocol.commands import Command, parse_command
from sonarlog.protocol.framing import Frame, Framer
from sonarlog.protocol.packets import MOTORS, ConfigPacket, Packet, Reset, Sip, Sync
from sonarlog.session import NoAnswer, RobotSilent, Session

MS = 1_000_000
HELLO = [Sync(0), Sync(1), Sync(2, ("Bob", "Pioneer", "amigo-sh"))]


def said(session: Session, t_ms: int) -> list[int]:
    """Command numbers sent at that time."""
    pieces = Framer().feed(session.send(t_ms * MS), 0)
    return [parse_command(piece.body).number for piece in pieces if isinstance(piece, Frame)]


def opened(*, drive: bool = False) -> Session:
    session = Session(drive=drive)
    for step, packet in enumerate(HELLO):
        assert said(session, step) == [step]
        session.receive(step * MS, packet)
    assert said(session, 3) == [Command.OPEN]
    session.receive(100 * MS, Sip(sonar=((0, 900),)))
    return session


def keep(session: Session, begin_ms: int, end_ms: int, *packets: Packet) -> list[int]:
    """All commands sent while these packets come every 100 ms."""
    commands = []
    for t in range(begin_ms, end_ms, 100):
        for packet in packets:
            session.receive(t * MS, packet)
        commands += said(session, t)
    return commands


def test_an_open_robot_is_kept_awake_and_a_missing_config_is_asked_for_three_times() -> None:
    session = opened()
    commands = keep(session, 100, 5100, Sip(sonar=((0, 900),)))
    assert commands.count(Command.PULSE) == 10
    assert commands.count(Command.CONFIG) == 3
    assert set(commands) == {Command.PULSE, Command.CONFIG}  # nobody asks a real robot for the truth
    assert session.open
    assert not session.ready


def test_motors_are_asked_for_until_they_are_on_and_again_when_they_go_off() -> None:
    session = opened(drive=True)
    session.receive(0, ConfigPacket(()))
    assert keep(session, 100, 1100, Sip(sonar=((0, 900),))).count(Command.ENABLE) == 2
    running = Sip(flags=MOTORS, sonar=((0, 900),))
    assert Command.ENABLE not in keep(session, 1100, 2100, running)
    assert session.ready
    commands = keep(session, 2100, 2200, Sip(sonar=((0, 900),)))
    assert commands[-2:] == [Command.STOP, Command.ENABLE]
    assert [event.text for event in session.take_events()][-1] == "the motors went off (stalled or stopped by hand)"


def test_after_a_silence_stop_comes_before_any_pulse_and_then_it_gives_up() -> None:
    session = opened(drive=True)
    keep(session, 100, 1000, Sip(flags=MOTORS, sonar=((0, 900),)))
    commands = keep(session, 2000, 8000)
    assert Command.STOP in commands
    assert Command.PULSE not in commands
    assert not session.ready
    with pytest.raises(RobotSilent, match="sent nothing for 8 s"):
        keep(session, 8000, 10_000)


@pytest.mark.parametrize(
    ("packets", "message"),
    [([], "nothing came back"), (HELLO[:1], "1 packets came back"), (HELLO, "took part in the handshake")],
)
def test_who_does_not_answer_is_given_up(packets: list[Packet], message: str) -> None:
    session = Session(drive=True)
    for t, packet in enumerate(packets):
        said(session, t)
        session.receive(t * MS, packet)
    with pytest.raises(NoAnswer, match=message):
        keep(session, 10, 20_000)
    assert bool(session.leave()) == (packets == HELLO)


@pytest.mark.parametrize("kind", [0x32, 0x33])
def test_a_robot_that_answers_sync_with_sips_is_closed_and_greeted_anew(kind: int) -> None:
    session = Session(drive=False)
    assert said(session, 0) == [0]
    session.receive(50 * MS, Sip(type=kind))
    assert said(session, 60) == [Command.STOP, Command.CLOSE]
    session.receive(100 * MS, Sip(type=kind))  # was on its way already
    assert said(session, 200) == []
    assert said(session, 600) == [0]
    for packet in HELLO:
        session.receive(700 * MS, packet)
    assert said(session, 700) == [Command.OPEN]
    assert next(e.text for e in session.take_events()).startswith("the robot was still open")


def test_a_reset_is_followed_by_a_new_handshake() -> None:
    session = opened()
    session.receive(1000 * MS, Reset())
    assert not session.open
    assert said(session, 1100) == []
    assert said(session, 1300) == [0]
