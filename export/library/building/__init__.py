"""Making a library.

The tasks of instances and entries, where they run, and the files about the library as a whole.
What to make is plan; whether it is right is checking.
"""
