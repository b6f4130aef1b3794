"""The command line: a table of commands, loaded when called, and the one net for errors.

Must not import anything heavy: `sonarlog --help` is shown before numpy would have loaded.
"""

import importlib
import sys
import traceback

import click

COMMANDS = {  # name: (module, one line of help)
    "record": ("cli.record", "Drive a robot and record its sweeps to an MCAP file."),
    "explore": ("cli.explore", "Let the robot decide where to go until all is mapped, and record it."),
    "replay": ("cli.replay", "Replay a recording through the SLAM pipeline."),
    "diff": ("cli.diff", "Say what differs between two runs."),
    "eval": ("cli.eval", "Hold runs against the truth: errors of path and map."),
    "bisect": ("cli.bisect", "Find the revision that first gives another result."),
    "cache": ("cli.cache", "Show or clear the runs that diff and bisect made on the way."),
    "verify": ("cli.verify", "Replay a run's recording again and say whether every bit is the same."),
    "info": ("cli.info", "Say what is in a recording or a run."),
    "check": ("cli.check", "Say whether a recording is sound, and what of it is usable."),
    "recover": ("cli.recover", "Make a sound file of a recording that was cut off or damaged."),
    "bench": ("cli.bench", "Measure every algorithm in every world, against the truth."),
    "calibrate": ("cli.calibrate", "Find what a robot's odometry and sonars get wrong, once and for all."),
    "sim": ("cli.sim", "Be an AmigoBot: the embedded robot as a server."),
    "import": ("cli.import_", "Bring other people's sonar logs in."),
    "export": ("cli.export", "Write a recording or a run as plain files for other programs."),
    "algorithms": ("cli.algorithms", "List the algorithms and their configuration."),
    "demo": ("cli.demo", "Run the main job end to end on the embedded robot."),
}


ALIASES = {"doctor": "check"}


class Commands(click.Group):
    """Commands imported only when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of a day's work."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the command's module and take the command of the same name."""
        cmd_name = ALIASES.get(cmd_name, cmd_name)
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(COMMANDS[cmd_name][0])
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands from the table, importing none."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="sonarlog")
def cli() -> None:
    """Record sonar robots, replay their logs to the same bits, diff the maps.

    Exit codes: 0 well, 1 differs or a check failed, 2 your input, 3 our bug, 130 interrupted.
    """


def main() -> None:
    """Run a command; every way out ends here with its exit code."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run with these arguments; return the exit code of the house rules."""
    try:
        result = cli.main(args=arguments, prog_name="sonarlog", standalone_mode=False)
    except click.Abort:
        return 130
    except click.ClickException as error:
        return _misused(error)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of our stdout went away: `sonarlog info … | head`
        sys.stderr.close()
        return 0
    except Exception as error:
        return _failed(error)
    return result if isinstance(result, int) else 0


def _misused(error: click.ClickException) -> int:
    """Say what is wrong with the command line in one sentence, and where to read more."""
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        error.show()
        return 2
    context = error.ctx if isinstance(error, click.UsageError) else None
    where = f" (see `{context.command_path} --help`)" if context else ""
    click.echo(f"sonarlog: {error.format_message().rstrip('.')}{where}", err=True)
    return 2


def _failed(error: Exception) -> int:
    from slam.errors import SlamError
    from sonarlog.errors import SonarlogError

    if isinstance(error, SonarlogError | SlamError):
        click.echo(f"sonarlog: {error}", err=True)
        return 2
    traceback.print_exception(error)
    click.echo("sonarlog: this is a bug of ours; the lines above say where.", err=True)
    return 3
