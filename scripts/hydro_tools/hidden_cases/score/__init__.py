"""Scores verdicts against sealed answers."""
