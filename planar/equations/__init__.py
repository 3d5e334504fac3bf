"""The constraint equations of a structure: residuals, rates, linear solves, and the compiled functions over z, u, p.

The symbols, everywhere in this room and in those above it. Lengths are divided by the mechanism's size, angles are in
rad, times in s; arrays of many positions have the samples first, arrays of many designs the designs last.

======  ================================================================================  =======================
z       unknowns: coordinates that remain after elimination, block after block            (unknowns,)
u       inputs: x, y, angle of every given link, then the positions of the inputs         (inputs,)
p       numbers: what the pairs take from the shapes of their links, pair after pair      (numbers,)
w       coordinates: x, y, angle of every moving link, then every pair's own              (coordinates,)
F       residuals: what the remaining constraints leave open, block after block           (rows,)
y       (z, u), what changes in time; p does not                                          (unknowns + inputs,)
z1, z2  first and second rates of z, so u1, u2 and y1, y2; w1, w2 of w, F1, F2 of F        as what they are rates of
q       points of links whose positions are wanted (x, y each); in `dynamics` w in m       (2 points,)
======  ================================================================================  =======================

A *block* is a group of unknowns that is solved together, by a slice of the rows of F; blocks stand in the order in
which they are solved, so that dF/dz is triangular by blocks. An entry of F or w is a length, or an angle: one that
closes modulo a turn, or one in which whole turns count.

An *element* is the formula of a pair as a list of instructions, derived once for all pairs of the same formula; the
equations of a mechanism are its elements, placed by indices. A *block type* is derived once for all blocks whose
equations are the same. Both are instruction lists, printed as Python for floats and arrays; those of all models are
kept with the package. Functions of a whole structure are derived only where its equations as a whole are evaluated
several times.

casadi_functions      casadi functions on arrays, and carried out on numbers of another kind
coordinates           what stands in w, and the frames of links that it makes
mechanism_numbers     structure, size and numbers p of a mechanism
residuals             the residuals of all pairs and inputs, for every arithmetic
linear                small linear systems, as expressions and for arrays
elements              the formulas of pairs: linear part, rest, derivatives; where a mechanism has them, and in groups
elimination           coordinates that enter rows with constant factors are solved for
symbolic_equations    structure, unknowns, rows and blocks; z, u, p, w, F as casadi expressions where they are needed
assembled_equations   F, w, rates and Jacobians from the elements by index arrays, at any number of samples
block_types           blocks by their own equations, placed by indices
block_type_functions  residuals, coordinates, closed form, motion and runs of a block type
block_motion          the coordinates of a block type with their rates, and how regular it is
closed_form           both assemblies of a block of two unknowns, derived from its equations
rates                 time derivatives of expressions in y, and of the unknowns
sparse_matrices       sparse Jacobians, their factors, and bordered ones along a curve
functions             F, w, rates and Jacobians by elements, or as compiled functions of the whole, kept on disk
constraint_check      every constraint with its rates by its pair's own formula, pairs of equal formula together
acceptance            positions and runs computed block after block, and all that they have to pass
"""
