"""Reading files in a separate process, with libraries whose errors would end this one.

process  starts the process, limits it, and returns the arrays that it sends
readers  the program of the process: a function for each library
"""
