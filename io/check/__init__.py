"""Results against baselines.

compare     two results: pictures, reports, other files
regression  a folder of results against a folder of baselines
reports     what was found, for people: HTML, Markdown, JSON
"""
