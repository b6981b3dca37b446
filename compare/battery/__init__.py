"""Hard cases, each with what is expected and why, judged by checks that are independent of the solvers."""
