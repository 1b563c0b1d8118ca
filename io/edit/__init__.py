"""`iccm edit`: a page in the browser for placing pins and strokes while the map follows.

session       the converged map, and the map that follows a drag
pair          the shapes, their inputs, and scenes in the core plane
page_view     the pair and its maps as the page shows them
solving       the converged map of a scene, as `iccm map` computes it
short_pins    pins that stop short of where they were dragged
placing       places on the other side, suggested pins, handles
map_choice    the choice between a continued map and one from scratch
scene         drawings and maps in the page's coordinates
own_drawing   pictures in the shapes' own files
surface_view  a mesh in space
suggest       pins that both drawings suggest
map_update    the answer with a map, or why there is none
saving        constraints, the command line, exports
drawn         pins and strokes in copies of the drawings
workspace     the open pair, and the files to choose from
autosave      unsaved changes, kept for the next start
link          the websocket between server and page
messages      messages from the page, validated
guard         access control
routes        routes of the server
server        the server's lifetime
wording       messages of iccm in the words of the page, which has controls instead of options
bent          where a map bends the detail of the picture, such as a smile that becomes a frown
"""
