"""Programs that read and solve our files, one module each.

Each module reports what its program read (model_content.py) and solves files (protocol.py). It runs in a
child process, where it may crash. export/verify and export/solutions decide whether an answer is right.
"""
