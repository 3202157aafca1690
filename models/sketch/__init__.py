"""From a drawing to an instance."""
