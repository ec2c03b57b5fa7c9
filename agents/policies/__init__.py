"""Trained policies: inference and files."""
