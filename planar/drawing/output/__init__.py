"""Pictures as files: PNG, PDF, SVG, animations, printed solutions."""
