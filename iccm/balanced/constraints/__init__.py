"""Pins and strokes that are met exactly: what they are, how they are checked, and how vertices are brought there."""
