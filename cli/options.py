"""Options that several commands share, spelled once."""

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

FILE = click.Path(path_type=Path, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)

force = click.option("--force", is_flag=True, help="Overwrite what exists.")
quiet = click.option("-q", "--quiet", is_flag=True, help="No progress, only results.")
as_json = click.option("--json", "as_json", is_flag=True, help="Machine-readable output.")


def algorithm_settings(command: Command) -> Command:
    """--config FILE.toml and --set block.key=value."""
    command = click.option(
        "--set", "changes", multiple=True, metavar="BLOCK.KEY=VALUE", help="Change one setting; may be repeated."
    )(command)
    return click.option("--config", type=FILE, help="Settings from a TOML file, one table a block.")(command)


def settings_from(config: Path | None, changes: tuple[str, ...]) -> dict[str, object]:
    """All settings by full name: those of the file, then those given one by one."""
    settings: dict[str, object] = {}
    if config is not None:
        try:
            settings |= _flat(tomllib.loads(config.read_text(encoding="utf-8")))
        except OSError as error:
            raise click.UsageError(f"cannot read {config}: {error.strerror}") from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise click.UsageError(f"{config} is no TOML: {error}") from None
    for change in changes:
        name, equals, text = change.partition("=")
        if not equals:
            raise click.UsageError(f"--set takes BLOCK.KEY=VALUE, not {change!r}")
        settings[name.strip()] = value_of(text.strip())
    return settings


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    flat: dict[str, object] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def value_of(text: str) -> object:
    """The value as TOML has it; what is no TOML is a text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
