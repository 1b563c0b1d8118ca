"""Bytes to nouns and back: shapes, images, meshes, reports.

files          inputs that are there; outputs that appear whole or not at all
references     files that other files refer to
limits         how much is read and made at most
options        the options of every command: one table
option_groups  options by what they are for, for help and the reference
formats        what files of each suffix hold
page           results on one page of HTML
spec           `file#part#number`
point_syntax   points as users name them
values         values of options, checked by their types and bounds
checked        documents, checked by pydantic in the same words
quiet_stderr   what C libraries say on stderr
memory         memory for pictures within a bound
svg/           SVG as outlines
pictures/      pictures in files
meshes/        meshes in files
outlines/      outlines in files of other kinds
shapes/        files of every format as shapes
materials/     materials of meshes, carried to new coordinates
geometry/      points, lines and polygons in files
artwork/       drawings carried through a map as drawings
run/           one job
read           shapes and pictures in files, for Python
apply          `iccm apply` with a saved map
batch/         many jobs
check/         results compared with baselines
edit/          the page of `iccm edit`
describe       what `iccm info` reports
sheet          the sheet of numbered parts that it draws
doctor         what `iccm doctor` examines
plugins        plug-ins for other programs, put into their folders
"""
