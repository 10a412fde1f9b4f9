"""Suites of starts for the comparison of schemes, and `bench`, which runs them."""
