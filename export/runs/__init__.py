"""Runs: every method on an instance, one by its name, or all side by side with a report and a page."""
