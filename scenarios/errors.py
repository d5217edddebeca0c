"""The one error for input a user can mend."""


class InputError(ValueError):
    """Bad input, refused before any compute.

    The message is one line: where (file and line, or field), the value found, the rule it breaks, and the remedy.
    """
