"""Exploring: a robot that decides by itself where to go, by the same pipeline that replays what it recorded."""
