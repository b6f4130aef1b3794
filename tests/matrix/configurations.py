"""The configurations: other SIMD levels, libm, BLAS kernels, hash seeds, numpys, Pythons, and another architecture."""

import glob
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
HOME = ROOT / "out" / "matrix"
"""Where the packages of other interpreters are kept; remove it to fetch them anew."""

NO_FMA = "glibc.cpu.hwcaps=-AVX2,-AVX,-FMA,-FMA4,-AVX512F"
OLDEST, NEWEST = "==2.1.*", ">=2.1"
LIBRARIES = ("mcap>=1.6", "zstandard", "lz4")
SETTINGS = ("NPY_DISABLE_CPU_FEATURES", "GLIBC_TUNABLES", "OPENBLAS_CORETYPE", "PYTHONHASHSEED")

_FEATURES = (
    "import json; from numpy._core._multiarray_umath import __cpu_dispatch__ as d, __cpu_features__ as f;"
    "print(json.dumps([name for name in d if f.get(name)]))"
)


@dataclass(frozen=True)
class Configuration:
    """One way to run the probe. `claims` are the canaries that it must change against the first configuration.

    `skipped` says why it cannot be had here; empty: it can.
    """

    name: str
    python: tuple[str, ...] = ()
    environment: dict[str, str] = field(default_factory=dict)
    claims: tuple[str, ...] = ()
    skipped: str = ""
    slow: bool = False

    def run(self, arguments: list[str]) -> str:
        """The probe's output. Raises subprocess.CalledProcessError."""
        kept = {name: value for name, value in os.environ.items() if name not in SETTINGS}
        path = {"PYTHONPATH": os.pathsep.join([str(ROOT), self.environment.get("PYTHONPATH", "")]).rstrip(os.pathsep)}
        command = [*self.python, "-W", "error::ImportWarning", "-m", "tests.matrix.probe", *arguments]
        environment = kept | {"PYTHONDONTWRITEBYTECODE": "1"} | self.environment | path
        made = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
        return made.stdout


def dispatched(python: tuple[str, ...], environment: dict[str, str]) -> list[str]:
    """The SIMD levels that this numpy would use on this machine, by the names that NPY_DISABLE_CPU_FEATURES takes.

    They are other names in other versions of numpy; a wrong one switches nothing off.
    """
    command = [*python, "-c", _FEATURES]
    made = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    names: list[str] = json.loads(made.stdout)
    return names


def at_hand() -> list[Configuration]:
    """This Python and this numpy, made to compute as other machines do. The first is the machine as it is."""
    python = (sys.executable,)
    levels = dispatched(python, {})
    wide = [name for name in levels if name.startswith(("AVX512", "X86_V4"))]
    fma = _has("fma")
    return [
        Configuration("as it is", python, {"PYTHONHASHSEED": "0"}),
        Configuration("hash seed 1", python, {"PYTHONHASHSEED": "1"}, ("hash",)),
        _without("no AVX-512", python, wide),
        _without("no SIMD", python, levels),
        Configuration(
            "libm without FMA", python, {"GLIBC_TUNABLES": NO_FMA}, ("libm",), "" if fma else "this machine has no FMA"
        ),
        Configuration("BLAS of 2008", python, {"OPENBLAS_CORETYPE": "Nehalem"}, ("blas",), _foreign()),
        worst(python, levels),
    ]


def worst(python: tuple[str, ...], levels: list[str]) -> Configuration:
    """Everything switched off at once."""
    settings = {
        "NPY_DISABLE_CPU_FEATURES": " ".join(levels),
        "GLIBC_TUNABLES": NO_FMA,
        "OPENBLAS_CORETYPE": "Nehalem",
        "PYTHONHASHSEED": "2",
    }
    missing = _foreign() or ("" if levels and _has("fma") else "nothing to switch off here")
    return Configuration("all of these at once", python, settings, ("numpy", "libm", "blas", "hash"), missing)


def _without(name: str, python: tuple[str, ...], levels: list[str]) -> Configuration:
    settings = {"NPY_DISABLE_CPU_FEATURES": " ".join(levels), "PYTHONHASHSEED": "0"}
    return Configuration(name, python, settings, ("numpy",), "" if levels else "this machine has none")


def _has(flag: str) -> bool:
    try:
        return flag in Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
    except OSError:
        return False


def _foreign() -> str:
    return "" if os.uname().machine == "x86_64" else "not an x86-64 machine"


def interpreters() -> dict[str, str]:
    """A Python of each supported minor version that really runs here, by version."""
    places = [*os.environ.get("PATH", "").split(os.pathsep)]
    for pattern in ("~/.pyenv/versions/*/bin", "~/.local/share/uv/python/*/bin"):
        places += sorted(glob.glob(os.path.expanduser(pattern)))
    found: dict[str, str] = {}
    for version in ("3.11", "3.12", "3.13"):
        for place in places:
            path = Path(place) / f"python{version}"
            if version not in found and path.is_file() and _runs(path, version):
                found[version] = str(path)
    return found


def _runs(path: Path, version: str) -> bool:
    """A shim of a version manager may be there and run nothing."""
    question = "import sys, ctypes, json; print('%d.%d' % sys.version_info[:2])"
    try:
        made = subprocess.run([str(path), "-c", question], capture_output=True, text=True, check=False, timeout=30)
    except (OSError, subprocess.SubprocessError):
        return False
    return made.returncode == 0 and made.stdout.strip() == version


def others() -> Iterator[Configuration]:
    """The oldest and the newest numpy under every Python of this machine."""
    for version in ("3.11", "3.12", "3.13"):
        for age, wanted in (("oldest", OLDEST), ("newest", NEWEST)):
            name = f"Python {version}, {age} numpy"
            python = interpreters().get(version)
            if python is None:
                yield Configuration(name, skipped=f"no Python {version} here")
                continue
            folder = HOME / f"py{version}-{age}"
            missing = fetch(folder, version, wanted)
            yield Configuration(
                name,
                (python,),
                {"PYTHONPATH": str(folder), "PYTHONHASHSEED": "0", "PYTHONNOUSERSITE": "1"},
                (),
                missing,
            )


def fetch(folder: Path, version: str, numpy: str, *platform: str) -> str:
    """Put numpy and the libraries that a replay needs there, once; the reason if they cannot be had."""
    if (folder / "ready").exists():
        return ""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-warn-conflicts"]
    where = ["--target", str(folder), "--upgrade", "--only-binary=:all:", "--python-version", version, *platform]
    made = subprocess.run([*pip, *where, f"numpy{numpy}", *LIBRARIES], capture_output=True, text=True, check=False)
    if made.returncode != 0:
        return f"pip: {made.stderr.strip().splitlines()[-1] if made.stderr.strip() else 'failed'}"
    (folder / "ready").touch()
    return ""
