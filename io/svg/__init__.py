"""SVG: XML read safely, what is drawn, and the outlines of what is filled.

reader     a drawing's outlines and drawn constraints
document   its bytes, compressed or not, XML read safely, and the size of the drawing
tree       what it renders: `use`, symbols, views, styles and clips resolved
stylesheet  rules and their selectors
basic_shapes  runs of paths, circles, rectangles and so on
fonts_in_css  sizes of fonts, and lengths that refer to them
lettering  a <text>, where the fonts that it asks for are found
directions  text that runs both ways
fonts      lines of letters as path data
css        declarations
affine     `transform` lists and viewports
path_data  path data as polylines
curves     pieces of curves, their polylines, and those with fewer vertices
batches    many pieces at once
fill       the regions that a fill paints
strokes    the regions that lines paint, and silhouettes
gaps       small gaps in lines, which the eye closes
painted    what a whole drawing paints, closed lines filled where lines draw it
clips      what clip paths and masks leave
crossings  crossing lines, counted up to a limit
drawing    `Drawing`: outlines, canvas, constraints, of any format
data_uri   files that it holds in addresses
budget     the work that a drawing may ask for
"""
