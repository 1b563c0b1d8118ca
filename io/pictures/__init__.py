"""Pictures in files: read as stored, written with colour space and metadata kept.

icc          CMYK and Lab by their ICC profile
image        pictures as stored: colour space, alpha, depth
image_files  read and written, metadata kept
pillow       pictures opened with Pillow, by an allow-list of formats
png          PNG files, deflated fast
stmap_files  STMaps read and written
tiles        UDIM tiles: `name.<UDIM>.png`
"""
