"""Pictures in files: read as stored, written with colour space and metadata.

georeferenced  GeoTIFF and world files
icc          CMYK and Lab converted by ICC profiles
image        pictures as stored: colour space, alpha, depth
image_files  reading and writing, including metadata
pillow       pictures opened with Pillow, restricted to an allow-list of formats
raster       what pictures of numbers have besides pixels
rasters      pictures of numbers: no data, labels, channels
png          fast compression of PNG files
stmap_files  reading and writing of STMaps
tiles        UDIM tiles: `name.<UDIM>.png`
"""
