"""Statistics of runs: shares and intervals, paired tests, association, random numbers."""
