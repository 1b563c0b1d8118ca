"""Holes of both domains.

bays       outlines with their concavities filled
given      holes as the user gave them, and requested partners
outlines   outlines of holes at one level
filled     holes without a partner: filled in the source, cut from the target
"""
