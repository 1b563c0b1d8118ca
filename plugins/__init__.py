"""Plug-ins for other programs, installed by `iccm plugins install`. They run iccm as a process; Figma's runs alone.

inkscape/        an extension of Inkscape 1.2 and later
blender/         an add-on of Blender 4.2 and later
figma/           a plug-in of Figma, whose window is the demo of the site (web/figma.js)
iccm_process.py  runs iccm for the first two; copied with each
"""
