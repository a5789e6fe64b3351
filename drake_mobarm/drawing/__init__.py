"""Brushes for Meshcat and matplotlib that the jobs share."""
