"""Inspecting a replay in Rerun's viewer, sweep by sweep; `rerun_door` is the only module that knows Rerun."""
