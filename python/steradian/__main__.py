"""``python -m steradian`` is the ``steradian`` command."""

import sys

from ._command import main

sys.exit(main())
