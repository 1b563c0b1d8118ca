"""Figures of a run: what `--plot` writes."""
