"""What planar.synthesise finds, beside what was published: errors in one metric, shares of tasks met, times."""
