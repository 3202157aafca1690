"""The study of docs/study.md: its plan, its runs as rows of CSV files, and the page with its plots."""
