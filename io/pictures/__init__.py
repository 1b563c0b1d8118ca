"""Pictures in files: read as stored, written with colour space and metadata kept."""
