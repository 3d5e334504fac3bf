"""Problems for a class: variants of a mechanism, what is asked of them, and marks for what comes back."""
