"""Where work runs, and when it ends.

Deadlines, Ctrl-C, and the same work side by side in processes that never outlive this one.
What is worked on is models/search; solvers as programs of their own are export/solving.
"""
