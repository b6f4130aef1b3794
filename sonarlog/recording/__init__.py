"""Recordings: what a robot and its sonars said, in one MCAP file that replays and that other tools open."""

from sonarlog.recording.reader import NotARecording, open_recording, read_log, recording_digest
from sonarlog.recording.writer import RecordingWriter

__all__ = ["NotARecording", "RecordingWriter", "open_recording", "read_log", "recording_digest"]
