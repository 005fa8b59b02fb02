# SPDX-License-Identifier: Apache-2.0
"""What went wrong, as exceptions. Their text is the one that the command line prints: place, reason, remedy."""

from __future__ import annotations

from typing import List, NamedTuple, Optional, Sequence, Tuple

__all__ = ["Error", "InputError", "Problem", "UnavailableError"]


class Problem(NamedTuple):
    """One mistake in a file."""

    file: str
    line: int  #: From 1 on; 0 = the whole file.
    column: int  #: From 1 on; 0 = the whole line.
    key: str  #: Path of the key, as "models.carton.mass"; "" = the whole file.
    reason: str
    remedy: str


class Error(Exception):
    """Something outside the program is wrong. `code` is a name as in answers, such as "not_found"."""

    code: str

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.code = code

    def __reduce__(self) -> Tuple[object, ...]:
        return type(self), (str(self), self.code)


class InputError(Error, ValueError):
    """What was given is wrong: a file, a question, an argument. The command line ends with 2 on it."""

    problems: Tuple[Problem, ...]  #: The mistakes in a scene file, in its order; empty for everything else.

    def __init__(self, message: str, code: str = "invalid_input", problems: Sequence[Problem] = ()) -> None:
        super().__init__(message, code)
        self.problems = tuple(problems)

    @property
    def file(self) -> Optional[str]:
        """Of the first mistake."""
        return self.problems[0].file if self.problems else None

    @property
    def line(self) -> Optional[int]:
        """Of the first mistake."""
        return self.problems[0].line if self.problems else None

    @property
    def remedy(self) -> Optional[str]:
        """Of the first mistake."""
        return self.problems[0].remedy if self.problems else None

    def __reduce__(self) -> Tuple[object, ...]:
        return type(self), (str(self), self.code, self.problems)


class UnavailableError(Error, RuntimeError):
    """A device, a package or memory is missing now. The command line ends with 1 on it."""


def error_of(code: str, message: str, problems: List[Tuple[str, int, int, str, str, str]]) -> Error:
    """The exception of a failure, for the compiled part of the package."""
    code = code.replace(" ", "_")
    if code in ("unavailable", "cancelled"):
        return UnavailableError(message, code)
    return InputError(message, code, [Problem(*problem) for problem in problems])
