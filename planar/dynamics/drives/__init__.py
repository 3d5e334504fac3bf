"""What drives and holds inputs: motors, and stops on which pairs are pressed."""
