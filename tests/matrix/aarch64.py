"""Another architecture on this machine: Debian's own Python for arm64 under qemu's user emulation.

apt fetches into a folder of its own; nothing is installed and nothing of the system is changed.
"""

import subprocess
from pathlib import Path

from tests.matrix.configurations import HOME, NEWEST, Configuration, fetch

NAME = "aarch64 (emulated)"
FOLDER = HOME / "aarch64"
ROOT_FS = FOLDER / "root"
EMULATOR = "qemu-user-static"
PYTHON = (
    "libc6 libgcc-s1 libstdc++6 zlib1g libexpat1 libssl3 libffi8 libbz2-1.0 liblzma5 "
    "libpython3.11-minimal libpython3.11-stdlib python3.11-minimal"
)
PLATFORM = ("--platform", "manylinux_2_28_aarch64", "--platform", "manylinux2014_aarch64", "--implementation", "cp")


def emulated() -> Configuration:
    """The configuration, its packages fetched; skipped with the reason where they cannot be had."""
    try:
        reason = _fetch()
    except (OSError, subprocess.SubprocessError) as error:
        said = getattr(error, "stderr", "") or str(error)
        reason = f"Debian's packages cannot be had: {said.strip().splitlines()[-1] if said.strip() else error}"
    if reason:
        return Configuration(NAME, skipped=reason)
    python = (str(_emulator()), "-L", str(ROOT_FS), str(ROOT_FS / "usr/bin/python3.11"))
    settings = {"PYTHONPATH": str(FOLDER / "packages"), "PYTHONHOME": str(ROOT_FS / "usr"), "PYTHONHASHSEED": "0"}
    return Configuration(NAME, python, settings, ("numpy",), slow=True)


def _fetch() -> str:
    if not (FOLDER / "ready").exists():
        here = ["dpkg", "--print-architecture"]
        host = subprocess.run(here, capture_output=True, text=True, check=True).stdout.strip()
        for architecture, names in ((host, EMULATOR), ("arm64", PYTHON)):
            _unpack(architecture, names.split())
        (FOLDER / "ready").touch()
    return fetch(FOLDER / "packages", "3.11", NEWEST, *PLATFORM)


def _emulator() -> Path:
    return FOLDER / "host" / "usr/bin/qemu-aarch64-static"


def _unpack(architecture: str, names: list[str]) -> None:
    """Debian packages of an architecture, unpacked: the emulator for this machine, the Python for the other."""
    state, packages = FOLDER / f"apt-{names[0]}", FOLDER / f"packages-{names[0]}"
    for folder in (state / "lists/partial", state / "archives/partial", packages):
        folder.mkdir(parents=True, exist_ok=True)
    settings = {
        "Dir::State": state,
        "Dir::State::status": "/dev/null",
        "Dir::Cache": state,
        "APT::Architecture": architecture,
        "APT::Architectures::": architecture,
        "Acquire::Languages": "none",
        "APT::Sandbox::User": "",
    }
    apt = ["apt-get", "-qq", *(f"-o{name}={value}" for name, value in settings.items())]
    for words in (["update"], ["download", *names]):
        subprocess.run([*apt, *words], cwd=packages, capture_output=True, text=True, check=True, timeout=300)
    target = FOLDER / "host" if names == [EMULATOR] else ROOT_FS
    for package in sorted(packages.glob("*.deb")):
        subprocess.run(["dpkg-deb", "-x", str(package), str(target)], capture_output=True, text=True, check=True)
