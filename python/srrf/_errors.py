"""The exceptions of the package. All are :class:`SrrfError`, and each is also the built-in one that a caller expects."""


class SrrfError(Exception):
    """Anything that the package refuses or cannot do. The message says the fact and the way out."""


class InputError(SrrfError, ValueError):
    """A cloud or a pose that cannot be used: its shape, NaN everywhere, fewer than three points, all on one line."""


class InputTypeError(InputError, TypeError):
    """Not a cloud at all, such as text or complex numbers."""


class OptionError(SrrfError, ValueError):
    """An option that makes no sense, or weights or a device that cannot be used."""


class FileError(SrrfError, OSError):
    """A file that cannot be read or written."""


class MissingFileError(FileError, FileNotFoundError):
    """A file that is not there."""


class NoPoseError(SrrfError, RuntimeError):
    """Two good clouds for which no method found a pose. An answer that is doubtful is no error: see ``Result.abstain``."""


class ReadingWarning(UserWarning):
    """What should be known of how a file was read or written."""


class InternalError(SrrfError, RuntimeError):
    """A fault of the package itself. Please report it."""
