"""Structures whose blocks are all in closed form: any position of any design is evaluated at once, in any assembly."""
