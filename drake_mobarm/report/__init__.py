"""Pictures and files; the only package that imports matplotlib."""
