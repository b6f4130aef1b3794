"""`sonarlog recover`: make a sound recording of one that was cut off or damaged."""

from pathlib import Path

import click

from cli import options


@click.command("recover")
@click.argument("file", type=options.FILE)
@click.option("-o", "--output", required=True, type=options.FILE, help="The sound file to write.")
@options.force
def command(file: Path, output: Path, force: bool) -> int:
    """Rewrite a FILE that was cut off or damaged as a sound one with everything in it that is whole.

    Exit codes: 0 all of it, 1 a part (it says what is missing), 2 nothing.

    \b
    Example:
      sonarlog recover corridor.mcap.part -o corridor.mcap
    """
    from sonarlog.recording.recover import recover

    recovered = recover(file, output, force=force)
    for sentence in recovered.missing:
        click.echo(sentence, err=True)
    if not recovered.messages:
        click.echo(f"sonarlog: nothing in {file} can be recovered", err=True)
        return 2
    click.echo(f"{output}: {recovered.messages} messages over {recovered.seconds:.1f} s", err=True)
    return 1 if recovered.partly else 0
