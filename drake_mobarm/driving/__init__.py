"""Driving among things: following a waypoint, careful speed, a scan's gaps."""
