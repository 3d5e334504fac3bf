"""Is a position closed, and is it on the branch that it started on?"""
