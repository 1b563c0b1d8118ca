"""Map whole drawings by way of frames around them.

choice  search for the cheapest pair of frames, or fit of outlines
solve   solve for the map of two drawings
placed  maps that keep a drawing's proportions, inside another drawing or over it
composition  compose a picture: place it whole and upright in the target, with paper around it
silhouettes  silhouettes of a target: what may be shown of it where its own gaps would cut a picture to pieces
"""
