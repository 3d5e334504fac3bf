"""All complex solutions of a member of a family: found once, followed, certified."""
