// The reason of an outcome, and the changes to try.
