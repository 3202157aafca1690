"""Jinja2 layouts of model files. Layout only: every line of bulk is streamed in."""
