"""Loads scenarios, runs and repeats them, and writes their folders."""
