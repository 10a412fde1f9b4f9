"""Closing the loop: experiments, the loop, records, results and missions."""
