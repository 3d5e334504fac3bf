"""`python -m planar` is the command `planar`."""

from planar.cli import main

main(prog_name="planar")
