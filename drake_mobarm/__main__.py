"""`python -m drake_mobarm`: the command `mobarm`."""

import sys

from drake_mobarm.cli import main

if __name__ == "__main__":
    sys.exit(main())
