"""What a page carries of a mechanism: its drawing, polygons, centres, forces, numbers and functions as data."""
