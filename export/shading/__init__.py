"""Pictures of surfaces, in light."""
