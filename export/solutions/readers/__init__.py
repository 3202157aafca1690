"""One module a kind of solution file.

The table of readers, what they share (text), and a reader for each kind. A reader says what stands in a file;
what that means for a problem is export/solutions.
"""
