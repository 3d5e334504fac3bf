"""A mechanism's file as other texts: laid out for readers, or packed into a link."""
