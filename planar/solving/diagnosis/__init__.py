"""Why there is no answer, and what would mend it."""
