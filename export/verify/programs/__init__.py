"""One module a program that reads our files.

Each says what the program read or answered, as plain arrays (reading.py), in a child process where it may crash (worker.py).
Whether that is right is decided one folder above.
"""
