"""`iccm edit`: a page in the browser on which pins and strokes are placed and the map is seen to follow.

session   the shapes, the map at rest and the map that follows
scene     what the page draws of them
saving    constraints, copies of the drawings, the command line, exports
link      the conversation with the page
guard     who is answered
server    the files of the page, and the life of the server
"""
