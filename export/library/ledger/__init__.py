"""Best known points and bounds."""
