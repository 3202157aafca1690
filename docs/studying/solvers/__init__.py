"""The study of solvers: its plan, its runs, their statistics, and its section of docs/evidence.md."""
