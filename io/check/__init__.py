"""Comparison of results with baselines.

compare     comparison of two files: pictures, reports, others
regression  comparison of a folder of results with a folder of baselines
reports     the differences as HTML, Markdown or JSON
"""
