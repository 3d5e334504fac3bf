"""The space diagram: links, pairs, supports, springs, as a textbook draws them."""
