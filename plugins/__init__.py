"""Plug-ins for other programs, which `iccm plugins install` copies into their folders; they run iccm as a process.

inkscape/        an extension of Inkscape 1.2 and later
blender/         an add-on of Blender 4.2 and later
iccm_process.py  how both run iccm; copied with each
"""
