"""Drawing, field and surface on a page in the browser."""
