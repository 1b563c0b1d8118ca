"""Reading files in a separate process, with libraries whose errors would end this one.

process  starts the process, limits it, and returns the arrays that it sends
program  the program of the process
readers  functions of it, one for each library
"""
