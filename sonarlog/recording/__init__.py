"""Recordings: what a robot and its sonars said, in one MCAP file that replays and that other tools open."""

from sonarlog.recording.writer import RecordingWriter

__all__ = ["RecordingWriter"]
