"""Balanced maps of surfaces."""
