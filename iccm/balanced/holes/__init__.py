"""Holes of both domains.

bays       outlines with their concavities filled
given      holes as the user gave them, and wished partners
outlines   their outlines at one level
filled     holes without a partner: filled in the source, cut out of the target
"""
