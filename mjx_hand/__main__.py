"""`python -m mjx_hand`: the command `mjx-hand`, in a checkout that is not installed too."""

import sys

from mjx_hand.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
