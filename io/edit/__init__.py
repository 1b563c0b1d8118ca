"""`iccm edit`: a page in the browser for placing pins and strokes while the map follows.

session       the shapes, the converged map and the map that follows
map_choice    a map continued, or found anew
scene         what the page draws of them
own_drawing   what the shapes' own files show
surface_view  a mesh in space
suggest       pins that both drawings suggest
map_update    a map in the page, or why there is none
saving        constraints, the command line, exports
drawn         pins and strokes in copies of the drawings
workspace     what is edited, and the files to choose from
autosave      what was not saved, for the next start
link          the conversation with the page
messages      what the page may say
guard         who is answered
routes        what the server answers
server        the life of the server
"""
