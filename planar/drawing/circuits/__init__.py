"""The diagram of circuits and branches."""
