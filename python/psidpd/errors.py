"""What goes wrong, with the messages of the command line."""


class PsidpdError(Exception):
    """Any error of psidpd."""


class InputError(PsidpdError, ValueError):
    """A model, a scene, an array or another argument is wrong; where the command line exits with 2."""


class RunStoppedError(PsidpdError, RuntimeError):
    """A run stopped on its way: its physics failed, or a file could not be written; where the command line exits with 1."""
