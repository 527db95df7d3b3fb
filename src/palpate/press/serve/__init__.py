"""Let a body of a finished run be pressed in a browser of this machine: ``palpate press``."""
