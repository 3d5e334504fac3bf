"""Other programs' files: each kind is one file of the folder `kinds`, found by looking there."""
