"""SVG: read XML safely, resolve what is rendered, and extract the outlines of painted regions.

reader     the outlines and drawn constraints of a drawing
document   bytes, compressed or not, parsed safely; size of the drawing
tree       rendering tree: `use`, symbols, viewports, styles and clips resolved
stylesheet  rules and their selectors
basic_shapes  subpaths of paths, circles, rectangles and so on
fonts_in_css  font sizes, and lengths relative to them
lettering  <text> as outlines, where its fonts are found
directions  bidirectional text
fonts      lines of text as path data
css        declarations
affine     `transform` lists and viewports
path_data  path data as polylines
curves     curve segments, their polylines, and simplification of polylines
batches    flattening of many segments at once
fill       regions that a fill paints
strokes    regions that strokes paint, and silhouettes
gaps       small gaps in lines that the eye closes
painted    the painted area of a whole drawing, with closed lines filled where it is drawn by lines
clips      clip paths and masks
crossings  limits on crossing lines
drawing_content  outlines, canvas and constraints of a file of any format
data_uri   files embedded as data: addresses
budget     limits on the work that a drawing may require
css_functions  clip paths and filters that CSS writes as functions, such as `circle(40%)` or `blur(2px)`, as elements…
css_pictures  angular gradients, which Figma exports as HTML since SVG has none, as embedded pictures
installed_fonts  the files of installed fonts: found by fontconfig, else in the folders where systems keep fonts
flat_areas       the areas of each colour that a drawing of flat colours shows
"""
