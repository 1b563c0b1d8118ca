"""`iccm standardize`: specimens with landmarks mapped onto their mean shape, and the mean and spread of their pictures.

run         the whole command: read, superimpose, map, summarise
specimens   a specimen: its outline and its landmarks, from files
landmarks   landmarks of many specimens, in one file or in many
standard    the shape onto which specimens are mapped
statistics  mean and standard deviation at each pixel
"""
