"""SVG: XML read safely, what is drawn, and the outlines of what is filled."""
