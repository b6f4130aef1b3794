"""sonarlog cache."""

import json
import os
import time

import click

from cli.options import as_json


@click.command("cache")
@click.option("--clear", is_flag=True, help="Drop all of them.")
@as_json
def command(clear: bool, as_json: bool) -> None:
    """Show or clear the runs that diff and bisect made on the way.

    They are kept in SONARLOG_CACHE (default: sonarlog in the user's cache folder), up to SONARLOG_CACHE_MB (1024); the
    least recently used go first.

    \b
    Example:
      sonarlog cache
      sonarlog cache --clear
    """
    from sonarlog.cache import RunCache

    cache = RunCache.of(os.environ)
    found = cache.clear() if clear else cache.kept()
    total = sum(each.bytes for each in found)
    if as_json:
        runs = [{"file": str(each.path), "bytes": each.bytes, "used_ns": each.used_ns} for each in found]
        facts = {
            "folder": str(cache.folder),
            "limit_bytes": cache.limit,
            "bytes": total,
            "cleared": clear,
            "runs": runs,
        }
        click.echo(json.dumps(facts, indent=2))
        return
    what = "dropped from" if clear else "in"
    count = f"{len(found)} run{'' if len(found) == 1 else 's'}"
    click.echo(f"{count}, {total / 1e6:.1f} MB, {what} {cache.folder} (up to {cache.limit / 1e6:.0f} MB)")
    for each in [] if clear else reversed(found):
        used = time.strftime("%Y-%m-%d %H:%M", time.localtime(each.used_ns / 1e9))
        click.echo(f"{used}  {each.bytes / 1e6:6.1f} MB  {each.path.name}")
