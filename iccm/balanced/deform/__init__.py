"""Shapes moved by pins and strokes alone: the balanced energy over the shape, its outline free."""
