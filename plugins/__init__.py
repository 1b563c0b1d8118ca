"""Plug-ins for other programs, installed by `iccm plugins install`. They run iccm as a separate process.

inkscape/        an extension of Inkscape 1.2 and later
blender/         an add-on of Blender 4.2 and later
iccm_process.py  runs iccm for both; copied with each
"""
