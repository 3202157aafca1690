"""Programs that read and solve our files, a module for each.

Each module reports what its program read (reading.py) and solves files (protocol.py). It runs in a child
process, where it may crash. Whether an answer is right is decided in export/verify and export/solutions.
"""
