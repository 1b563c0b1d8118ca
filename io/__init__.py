"""Input and output: files read as shapes, images and meshes, and results written to files.

files          checked inputs, and outputs that appear whole or not at all
references     files that other files refer to
limits         limits on input and output
options        the table of options of every command
option_groups  options by topic, for help and the reference
formats        what files with each suffix can contain
page           results on one page of HTML
spec           `file#part#number`
point_syntax   points as users write them
values         validation of option values
checked        validation of documents by pydantic, with the same messages
extras         optional packages, and the extra of iccm that installs each
quiet_stderr   silences C libraries that write to stderr
memory         memory for pictures within a limit
svg/           SVG as outlines
pictures/      pictures in files
meshes/        meshes in files
outlines/      outlines in files of other formats
shapes/        files of every format as shapes
materials/     materials of meshes, carried to new coordinates
geometry/      points, lines and polygons in files
artwork/       drawings mapped as vector graphics
run/           one job
read           reading shapes and pictures from Python
apply          `iccm apply` with a saved map
compose        `iccm compose`
cartogram      `iccm cartogram`
projections    longitudes and latitudes projected to equal areas
itk_files      formats of ITK
fields         `iccm field`
batch/         many jobs
check/         results compared with baselines
standardize/   specimens on their mean shape
edit/          the page of `iccm edit`
describe       what `iccm info` reports
sheet          the figure of numbered parts for `iccm info --plot`
doctor         the checks of `iccm doctor`
plugins        installation of plug-ins for other programs
lengths        units of length, and the width and height of drawings in them
isolated/      reading files in a separate process, with libraries whose errors would end this one
figure_table   the keys of all JSON reports in one table: a row for each figure, with its type, unit and meaning
extensions     Extensions: mesh formats and commands of other packages, found by their entry points
"""
