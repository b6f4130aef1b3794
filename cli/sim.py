"""`sonarlog sim`: the embedded robot as a server."""

from typing import Any

import click


@click.command("sim")
@click.option("--world", metavar="NAME", help="A built-in world (--list names them), random:7, or your own FILE.toml.")
@click.option("--list", "list_worlds", is_flag=True, help="Name the built-in worlds and what they are.")
@click.option("--tour", "show_tour", is_flag=True, help="Print the world's tour, a route for `record`.")
@click.option("--listen", default="127.0.0.1:8101", show_default=True, metavar="HOST:PORT", help="TCP, one client.")
@click.option("--pty", "as_pty", is_flag=True, help="A pseudo terminal instead; its path is printed.")
@click.option("--seed", default=1, show_default=True, help="Which noise, and which errors of odometry.")
@click.option("--speed", default=1.0, show_default=True, help="How much faster than real time the robot lives.")
@click.option(
    "--odometry", default="1", show_default=True, metavar="ERRORS",
    help="A factor on the seed's errors (0: perfect), or rotation=1.01,distance=0.99,drift=0.3,slip=0.4.",
)  # fmt: skip
@click.option("--noise", default=10.0, show_default=True, metavar="MM", help="Standard deviation of a range.")
@click.option("--outliers", default=0.04, show_default=True, metavar="SHARE", help="Share of wild readings.")
@click.option("--mounting", default=0.0, metavar="DEG", help="How far the sonars look past where they ought to.")
@click.option("--dead", default="", metavar="SONARS", help="Sonars that hear nothing, such as 0,3.")
@click.option("--stuck", default="", metavar="SONAR:MM", help="Sonars that always say the same, such as 2:1500.")
@click.option("--kick", default="", metavar="KICK", help="Moved unawares once: after=10,turn=3 or after=10,aside=0.2.")
@click.option("--robot", default="amigo-sh", show_default=True, help="Robot type, or your own FILE.toml.")
def command(
    world: str | None, list_worlds: bool, show_tour: bool, listen: str, as_pty: bool, speed: float, **settings: Any
) -> None:
    """Be an AmigoBot in a simulated world, for any client that speaks its protocol.

    Example: sonarlog sim --world loop --listen 127.0.0.1:8101 --speed 10
    """
    if list_worlds:
        _list()
        return
    if world is None:
        raise click.UsageError("name a world with --world (--list shows them)")
    if show_tour:
        _show_tour(world)
        return
    host, port = _address(listen)

    import signal
    import time

    from sonarlog.sim.link import Simulation
    from sonarlog.sim.server import Pace, serve_pty, serve_tcp

    robot = Simulation(world, speed=speed, **settings).build()
    pace = Pace(time.monotonic_ns, speed)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # leave by the way of Ctrl-C
    if as_pty:
        serve_pty(robot, pace, announce=click.echo)
    else:
        serve_tcp(robot, host, port, pace, say=_say)


def _list() -> None:
    from sonarlog.sim.world import built_in, load_world

    for name in built_in():
        click.echo(f"{name:10}{load_world(name).about}")


def _show_tour(name: str) -> None:
    from sonarlog.sim.world import load_world

    click.echo(" ".join(load_world(name).tour.split()))


def _say(text: str) -> None:
    click.echo(text, err=True)


def _address(text: str) -> tuple[str, int]:
    host, colon, port = text.rpartition(":")
    if not colon or not port.isdecimal() or int(port) > 65535:
        raise click.UsageError(f"--listen takes HOST:PORT, such as 127.0.0.1:8101, not {text!r}")
    return host or "127.0.0.1", int(port)
