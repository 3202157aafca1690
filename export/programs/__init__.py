"""One module a program that reads our files.

Each says what the program read (reading.py) or answered, in a child process where it may crash (worker.py);
protocol.py says how. Whether that is right is decided one folder above.
"""
