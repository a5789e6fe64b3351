"""Buildings: obstacles read from SDF, outlines, occupancy."""
