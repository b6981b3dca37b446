"""What differs between the versions of dolfinx and PETSc."""
