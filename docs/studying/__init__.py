"""The study behind docs/evidence.md: its plan, its runs as rows of CSV files, and the page with its plots."""
