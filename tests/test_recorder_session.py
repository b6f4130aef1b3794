"""The session alone, packet by packet: what it sends when, and when it gives up."""

from dataclasses import replace

import pytest

from sonarlog.protocol.commands import Command, parse_command
from sonarlog.protocol.framing import Frame, Framer
from sonarlog.protocol.packets import E_STALL, MOTORS, STOP_BUTTON, ConfigPacket, Packet, Reset, Sip, Sync
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
    assert session.take_events()[-1].text == "no CONFIG packet passed its checksum: going on without one"
    assert commands.count(Command.PULSE) == 10
    assert commands.count(Command.CONFIG) == 3
    assert set(commands) == {Command.PULSE, Command.CONFIG}  # nobody asks a real robot for the truth
    assert session.open
    assert not session.ready


def test_motors_are_asked_for_until_they_are_on() -> None:
    session = opened(drive=True)
    session.receive(0, ConfigPacket(()))
    assert keep(session, 100, 1100, Sip(sonar=((0, 900),))).count(Command.ENABLE) == 2
    running = Sip(flags=MOTORS, sonar=((0, 900),))
    assert Command.ENABLE not in keep(session, 1100, 2100, running)
    assert session.ready


RUNNING = Sip(flags=MOTORS, sonar=((0, 900),))


@pytest.mark.parametrize(
    ("sip", "why"),
    [
        (replace(RUNNING, flags=0), "the motors were switched off"),
        (replace(RUNNING, flags=STOP_BUTTON), "the STOP button is pressed"),
        (replace(RUNNING, flags=MOTORS | E_STALL), "the robot made an emergency stop"),
        (replace(RUNNING, stall_bumps=0x0200), "a bumper is pressed"),
        (replace(RUNNING, stall_bumps=0x0100), "the wheels stalled"),
    ],
)
def test_what_stops_the_robot_halts_the_route_for_good(sip: Sip, why: str) -> None:
    session = opened(drive=True)
    keep(session, 100, 1000, RUNNING)
    assert session.ready
    session.receive(1000 * MS, replace(RUNNING, stall_bumps=0x0001))  # for a moment: no obstacle
    before = session.ready
    assert Command.ENABLE not in keep(session, 1100, 3000, sip)
    assert Command.ENABLE not in keep(session, 3000, 4000, RUNNING)
    assert session.halted == why
    assert (before, session.ready) == (True, False)
    assert f"the route is halted: {why}" in [event.text for event in session.take_events()]


def test_where_nothing_is_driven_a_pressed_button_is_no_news() -> None:
    session = opened()
    keep(session, 100, 1000, RUNNING)
    keep(session, 1000, 2000, Sip(flags=STOP_BUTTON, sonar=((0, 900),)))
    assert not session.halted


def test_after_its_own_pause_the_recorder_says_stop_before_any_pulse() -> None:
    """SIPs that waited on the line are no silence, but the robot's watchdog has stopped it all the same."""
    session = opened(drive=True)
    keep(session, 100, 1000, RUNNING)
    session.receive(11_000 * MS, RUNNING)
    assert said(session, 11_000)[:2] == [Command.STOP, Command.PULSE]
    assert "held up for 10.1 s" in session.take_events()[-1].text


def test_a_new_line_begins_with_the_handshake() -> None:
    session = opened(drive=True)
    keep(session, 100, 1000, RUNNING)
    session.restart(5000 * MS)
    assert not session.open
    assert said(session, 5000) == [0]
    for step, packet in enumerate(HELLO):
        session.receive((5100 + step) * MS, packet)
        assert said(session, 5100 + step) == [[1], [2], [Command.OPEN]][step]
    session.receive(5200 * MS, Sip(sonar=((0, 900),)))  # a robot opened anew has its motors off
    assert not session.halted
    assert Command.ENABLE in said(session, 5200)


def test_after_a_silence_stop_comes_before_any_pulse_and_then_it_gives_up() -> None:
    session = opened(drive=True)
    keep(session, 100, 1000, Sip(flags=MOTORS, sonar=((0, 900),)))
    commands = keep(session, 2000, 5000)
    assert Command.STOP in commands
    assert Command.PULSE not in commands
    assert not session.ready
    with pytest.raises(RobotSilent, match="sent nothing for 5 s"):
        keep(session, 5000, 7_000)


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
