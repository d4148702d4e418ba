"""Pictures of what was found: a report for the Rerun viewer, figures for a page."""
