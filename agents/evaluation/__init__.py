"""Judging agents: episodes, means with intervals, tables and pictures."""
