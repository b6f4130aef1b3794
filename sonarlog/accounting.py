"""Used and left out: every packet and reading of a recording is in the sums, and what was left out has its reason.

Must not know: how anything is counted, printing.
"""

from collections.abc import Mapping

USED = ("packets", "sips", "readings", "sweeps", "readings_used", "decisions")
REASONS = {
    "bad_packets": "their checksum is wrong",
    "bad_packet_bytes": "of packets whose checksum is wrong",
    "junk_bytes": "between packets",
    "unknown_packets": "of a kind that a replay has no use for",
    "malformed_packets": "shorter than their kind",
    "missing_readings": "announced by packets that end before them",
    "bad_discs": "readings of a sonar that the robot does not have",
    "damage": "places where the file is cut off or altered",
    "unknown_sonar": "readings of a sonar without a mounting",
    "unusable_readings": "too near to be measured, or not a number",
    "readings_without_odometry": "before or after all odometry",
    "readings_left_out_between_scans": "taken while driving from scan to scan",
    "readings_left_out_short_stretches": "in stretches too short for a sweep",
}
"""What is left out, by the name it is counted under, and why."""

EVENTS = {
    "resets": "resets of the robot's controller: odometry starts anew",
    "gaps": "silences of over a second",
    "odometry_jumps": "jumps of odometry that no robot can drive: it starts anew",
}
"""What happened and took nothing away."""

TWICE = "readings_used_twice"


class Unaccounted(RuntimeError):
    """The sums do not come out, or something was left out without a reason: a bug of ours."""


def check(counts: Mapping[str, int]) -> None:
    """Raises Unaccounted unless every count has a meaning and the readings add up."""
    unknown = [name for name, count in counts.items() if count and name not in {*USED, *REASONS, *EVENTS, TWICE}]
    if unknown:
        raise Unaccounted(f"left out without a reason: {', '.join(f'{counts[name]} {name}' for name in unknown)}")
    left_out = sum(count for name, count in counts.items() if name.startswith("readings_left_out_"))
    twice = counts.get(TWICE, 0)
    if counts.get("readings", 0) != counts.get("readings_used", 0) - twice + left_out:
        raise Unaccounted(
            f"{counts.get('readings', 0)} readings, but {counts.get('readings_used', 0)} used ({twice} twice) "
            f"and {left_out} left out"
        )


def told(counts: Mapping[str, int]) -> list[str]:
    """What was used, then a line for each thing left out, with its reason."""
    packets = f"{counts['packets']} packets, " if counts.get("packets") else ""
    twice = f", {counts[TWICE]} of them twice: two turns share them" if counts.get(TWICE) else ""
    used = f"{counts.get('readings_used', 0)} in {counts.get('sweeps', 0)} sweeps{twice}"
    lines = [f"{packets}{counts.get('readings', 0)} readings, used {used}"]
    for name, reason in REASONS.items():
        if counts.get(name):
            lines.append(f"left out: {counts[name]} {_noun(name)}: {reason}")
    return lines + [f"{counts[name]} {reason}" for name, reason in EVENTS.items() if counts.get(name)]


def _noun(name: str) -> str:
    if name.startswith(("readings", "unusable", "unknown_sonar", "bad_discs")):
        return "readings"
    return name.replace("_", " ")
